"""The worker that runs a service's core over bus and journal, and its parts."""
