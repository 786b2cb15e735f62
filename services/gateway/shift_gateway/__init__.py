"""The gateway: REST, the live stream and the web page."""
