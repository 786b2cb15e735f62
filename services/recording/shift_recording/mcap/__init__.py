"""The MCAP format: records, scanner, reader, writer and schemas."""
