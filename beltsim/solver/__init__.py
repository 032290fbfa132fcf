"""The compiled solver: laws, shapes, passes and steps. Arrays in, arrays out; no text, no files, no ids."""
