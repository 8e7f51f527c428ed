"""Trials of policies on an arm: a frozen plan, an order nobody can guess, a ledger, an operator."""
