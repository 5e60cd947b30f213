"""Recurrences: the next Taylor coefficient of an operation from those of its operands."""
