"""One file per way to know where objects are; each carries the age of what it says."""
