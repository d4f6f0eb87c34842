"""Compiled kernels: options of the compiler, and the text that it compiles."""
