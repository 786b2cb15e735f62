"""The manifests for Kubernetes: valid by the schema of a released Kubernetes, and in line with the mesh's settings.

No cluster is started: this checks what can be known without one.
"""

from __future__ import annotations

import copy
import importlib.util
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import kubernetes_validate
import pytest
from ruamel.yaml import YAML
from shift_gateway.origins import RequestOrigin, Rules, WrongHost, host_names
from shift_gateway.settings import GatewaySettings
from shift_runtime.healthcheck import CHECKED
from shift_runtime.settings import ServiceSettings
from shift_schemas.registry import OWNERS
from shift_schemas.shards import every_shard, parse_shard

FOLDER = Path(__file__).parents[2] / "deploy" / "kubernetes"
KUBERNETES = "1.35.0"
FILES = sorted(path for path in FOLDER.glob("*.yaml") if path.name != "kustomization.yaml")
ROUTER_VARIABLES = {"SHIFT_ROUTER_LISTEN"}


def documents(path: Path) -> list[dict[str, Any]]:
    """Return the documents of a YAML file."""
    return list(YAML(typ="safe").load_all(path.read_text()))


def named(kind: str, name: str) -> dict[str, Any]:
    """Return the one resource of this kind and name."""
    (found,) = [d for path in FILES for d in documents(path) if (d["kind"], d["metadata"]["name"]) == (kind, name)]
    return found


def pods() -> Iterator[dict[str, Any]]:
    """Yield the pod of each workload."""
    for kind, name in (("Deployment", "router"), ("StatefulSet", "shard"), ("Deployment", "gateway")):
        yield named(kind, name)["spec"]["template"]["spec"]


CONTAINERS = {container["name"]: container for pod in pods() for container in pod["containers"]}


def variables(container: dict[str, Any]) -> dict[str, str]:
    """Return the variables of a container, with those of the configuration; references are kept as they are."""
    given = dict(named("ConfigMap", "shift-mesh")["data"]) if "envFrom" in container else {}
    return given | {v["name"]: v.get("value", "") for v in container.get("env", ())}


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_every_resource_is_valid(path: Path) -> None:
    assert documents(path)
    for document in documents(path):
        assert kubernetes_validate.validate(document, KUBERNETES, strict=True)


@pytest.mark.parametrize(
    ("kind", "name", "where", "value"),
    [
        ("StatefulSet", "shard", ("spec", "replicas"), "2"),
        ("StatefulSet", "shard", ("spec", "replica"), 2),
        ("NetworkPolicy", "mesh", ("spec", "policyTypes"), "Ingress"),
    ],
)
def test_mistake_in_a_resource_is_found(kind: str, name: str, where: tuple[str, str], value: object) -> None:
    wrong = copy.deepcopy(named(kind, name))
    wrong[where[0]][where[1]] = value
    with pytest.raises(kubernetes_validate.ValidationError):
        kubernetes_validate.validate(wrong, KUBERNETES, strict=True)


def test_kustomization_names_every_file() -> None:
    (kustomization,) = documents(FOLDER / "kustomization.yaml")
    assert sorted(kustomization["resources"]) == [path.name for path in FILES]


def test_replicas_are_the_number_of_shards() -> None:
    shards = int(named("ConfigMap", "shift-mesh")["data"]["SHIFT_SHARDS"])
    assert named("StatefulSet", "shard")["spec"]["replicas"] == shards


def test_each_owner_runs_in_every_shard_and_gets_its_number() -> None:
    (pod,) = [pod for pod in pods() if len(pod["containers"]) > 1]
    assert {container["name"] for container in pod["containers"]} == set(OWNERS)
    for container in pod["containers"]:
        names = [variable["name"] for variable in container["env"]]
        assert names.index("SHIFT_SHARD") > max(names.index("POD_INDEX"), names.index("SHIFT_SHARDS"))
        given = variables(container)["SHIFT_SHARD"]
        found = [parse_shard(given.replace("$(POD_INDEX)", str(n)).replace("$(SHIFT_SHARDS)", "2")) for n in range(2)]
        assert tuple(found) == every_shard(2)


@pytest.mark.parametrize("name", sorted(CONTAINERS))
def test_variables_commands_and_probes_exist(name: str) -> None:
    container = CONTAINERS[name]
    settings = GatewaySettings if name == "gateway" else ServiceSettings
    known = {f"SHIFT_{field.upper()}" for field in settings.model_fields} | ROUTER_VARIABLES
    own = {v["name"] for v in container.get("env", ()) if v["name"].startswith("SHIFT_")} - {"SHIFT_SHARDS"}
    assert own <= known
    assert container["command"][:2] == ["python", "-m"]
    assert importlib.util.find_spec(container["command"][2]) is not None
    probe = container["readinessProbe"]
    if "exec" in probe:
        assert probe["exec"]["command"] == ["python", "-m", "shift_runtime.healthcheck", name]
        assert name in CHECKED
    else:
        port = probe.get("tcpSocket", probe.get("httpGet"))["port"]
        assert port in {port["name"] for port in container["ports"]}


def test_gateway_accepts_its_own_probes_and_its_service_by_name() -> None:
    container = CONTAINERS["gateway"]
    given = variables(container)
    rules = Rules(given["SHIFT_HOST"], host_names(given["SHIFT_HOSTS"]), ())
    (header,) = container["readinessProbe"]["httpGet"]["httpHeaders"]
    for host in (header["value"], "gateway.shift-mesh.svc.cluster.local"):
        assert rules.check(RequestOrigin("GET", hosts=(host,))) is None
    with pytest.raises(WrongHost):
        rules.check(RequestOrigin("GET", hosts=("elsewhere.example",)))
    assert given["SHIFT_PORT"] == str(container["ports"][0]["containerPort"])


@pytest.mark.parametrize("name", sorted(CONTAINERS))
def test_container_has_no_rights(name: str) -> None:
    security = CONTAINERS[name]["securityContext"]
    assert security == {
        "allowPrivilegeEscalation": False, "readOnlyRootFilesystem": True, "capabilities": {"drop": ["ALL"]},
    }  # fmt: skip


def test_pods_are_not_root_and_have_no_token() -> None:
    for pod in pods():
        assert pod["automountServiceAccountToken"] is False
        assert pod["securityContext"]["runAsNonRoot"] is True
        assert pod["securityContext"]["runAsUser"] == 1000
