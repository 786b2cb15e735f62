"""What runs one service's core over bus and journal."""
