"""One task a file: where tool, object, goal and contact are in an observation."""
