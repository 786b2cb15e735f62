"""The shared shell: bus, journal, reader, worker, clock, settings, router and the mesh client."""
