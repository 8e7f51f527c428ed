"""The digital twin of a Franka arm: in this process, or served at a loopback address to the real driver."""
