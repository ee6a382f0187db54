"""Writers: values to files, whole or not at all."""
