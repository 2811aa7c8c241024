"""The base class of errors that a user can put right."""


class UserError(Exception):
    """Wrong input or set-up.  The text names the file or option, the key, its value and what is allowed.

    The command line prints it as one line and exits with status 1; any other exception is a bug.  Subclasses exist only
    where code handles them differently.
    """
