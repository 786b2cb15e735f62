#!/usr/bin/env bash
# Prints the name of a base image to build on; progress goes to standard error.
#
# Where the real one (python:3.11-slim-bookworm) is there or can be pulled, that is it. Where there is no
# registry, a stand-in is made from Debian's packages, in about 40 s, and kept under a name of its own:
# the same Debian, the same Python, pip and venv. For tests only; SHIFT_TEST_BASE names another one.
set -euo pipefail

real=python:3.11-slim-bookworm
if [ -n "${SHIFT_TEST_BASE:-}" ]; then
    echo "$SHIFT_TEST_BASE"
    exit
fi
if docker image inspect "$real" >/dev/null 2>&1; then
    echo "$real"
    exit
fi
if ! command -v mmdebstrap >/dev/null; then
    echo "No mmdebstrap to make a stand-in with: $real is to be pulled." >&2
    echo "$real"
    exit
fi

# A stand-in is remade when this script or the certificates that the machine adds change.
certificates=$(find /usr/local/share/ca-certificates -name '*.crt' 2>/dev/null | sort)
# shellcheck disable=SC2086
version=$(cat "$0" $certificates | sha256sum | cut -c1-12)
name="shift-mesh-test-base:$version"
if docker image inspect "$name" >/dev/null 2>&1; then
    echo "$name"
    exit
fi

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
started=$SECONDS
echo "Making $name in place of $real ..." >&2
mmdebstrap --quiet --variant=minbase --include=python3,python3-venv,python3-pip,ca-certificates \
    bookworm "$folder/rootfs.tar" >&2
docker import "$folder/rootfs.tar" "$name-bare" >/dev/null

mkdir "$folder/context"
mkdir "$folder/context/certificates"
for certificate in $certificates; do
    cp "$certificate" "$folder/context/certificates/"
done
cat > "$folder/context/Dockerfile" <<EOF
FROM $name-bare
COPY certificates /usr/local/share/ca-certificates
RUN update-ca-certificates >/dev/null 2>&1 && ln -s python3 /usr/bin/python
ENV PIP_CERT=/etc/ssl/certs/ca-certificates.crt LANG=C.UTF-8
CMD ["python"]
EOF
docker build --quiet --tag "$name" "$folder/context" >/dev/null
docker image rm --no-prune "$name-bare" >/dev/null
echo "$name made in $((SECONDS - started)) s." >&2
echo "$name"
