"""Files: recordings in, reports and estimates out."""

from impactjax._record.file_error import FileError as FileError
from impactjax._record.read_recording import RecordingFile as RecordingFile
from impactjax._record.read_recording import read_recording as read_recording
from impactjax._report.document import document as document
from impactjax._report.saved import load as load
from impactjax._report.saved import save as save
from impactjax._report.write import write_report as write_report
from impactjax._study.study_result import read_study as read_study
