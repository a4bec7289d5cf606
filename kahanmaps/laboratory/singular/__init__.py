"""What a map contracts, and what becomes of it."""
