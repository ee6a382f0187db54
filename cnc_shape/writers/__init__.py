"""Writers: results that are whole or absent, read back before they are published."""
