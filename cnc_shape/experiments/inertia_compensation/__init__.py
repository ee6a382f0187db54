"""Paper 003: a velocity gain that follows the load, on three axes that are loaded by three more motors."""
