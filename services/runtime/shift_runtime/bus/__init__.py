"""The bus between services: its protocol, over Zenoh and in memory."""
