"""The command line of volprep: each verb parses, calls one function, prints, and sets the exit status."""
