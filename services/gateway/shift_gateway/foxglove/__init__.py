"""The Foxglove WebSocket protocol at ``/foxglove``: running sessions, and recordings with playback control."""
