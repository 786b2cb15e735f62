"""The recorder: it owns the session, records every fact, and ends sessions."""
