"""One thing at a time made worse, until the judge refuses."""
