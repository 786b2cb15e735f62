"""The gateway: the door for REST, the live stream and the web page."""
