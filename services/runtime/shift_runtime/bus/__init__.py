"""The bus between services: its protocol, Zenoh and one in memory."""
