"""One file per robot: observe, command, stop. Drivers are imported only when a robot is made."""
