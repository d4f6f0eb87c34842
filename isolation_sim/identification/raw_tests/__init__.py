"""Test files as machines write them, imported as a campaign."""
