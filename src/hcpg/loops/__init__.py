"""The only code with side effects and clocks."""
