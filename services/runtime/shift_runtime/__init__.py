"""The runtime: bus, journal, reader, the worker that runs a core, read model, clients, settings and the router."""
