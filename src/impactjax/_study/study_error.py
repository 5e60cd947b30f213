"""Errors about the folder of a study."""


class StudyError(Exception):
    """Error about the folder of a study: it cannot be written, or holds something else. The message
    is one sentence with the file, the problem and the remedy.
    """
