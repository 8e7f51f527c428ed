"""Records of runs -> statistics -> tables and figures; does no learning."""
