"""Loop tables, and a law with effects that is fitted to them."""
