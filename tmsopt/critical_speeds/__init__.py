"""Speeds: every weave, capsize and meeting speed, exactly; growth over speed."""
