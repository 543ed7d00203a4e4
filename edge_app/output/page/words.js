// What the words of a record mean, in sentences: mode, status, activity of the calibration, its needs.
// A status that is new to record_status.h gets its sentence here; StatusPage.SaysInWordsWhatEachStatusMeans asks for it.

export const kModes = {
  OE: 'Orientation from pan/tilt readings and landmarks in the picture.',
  PT: 'Orientation from pan/tilt readings alone.',
  none: 'No orientation.',
};
export const kWhy = {
  'ok': '',
  'clock filter warming up': 'The clock filter is still warming up.',
  'picture time unknown': 'The picture may have waited on its way, nobody knows for how long.',
  'video lost': 'There is no connection to the video.',
  'telemetry lost': 'There is no connection to the pan/tilt head.',
  'too little telemetry': 'Hardly any pan/tilt reading has come yet.',
  'telemetry too old': 'The picture lies too far beyond the newest trusted pan/tilt angle (below; `alidade check` says why).',
  'gap in telemetry': 'Pan/tilt readings are missing around this picture.',
  'frame before telemetry': 'The picture is older than all pan/tilt readings.',
  'too few landmarks': 'Too few landmarks were recognised.',
  'landmarks contradict telemetry': 'Landmarks and pan/tilt readings contradict each other.',
  'scene moves': 'What is in view moves, as clouds or water do, or it is not known yet what of it stands still.',
  'no usable picture': 'The picture is missing or damaged.',
  'picture too late': 'The processor is behind: the picture had waited too long and was not looked at.',
  'picture repeated': 'The picture is the one before, sent again while the camera turned.',
  'no calibration for this zoom': 'There is no calibration for this zoom.',
  'not localized': 'The scene map has not told yet where the camera looks.',
  'not finite': 'A time stamp makes no sense.',
  'not calibrated': 'There is no calibration yet, or it was withdrawn: landmarks are not looked for.',
  'zoom moves': 'The zoom moves, and there are no landmarks yet that it could be followed with.',
  'focal length uncertain': 'The zoom curve does not know the focal length well enough at this zoom: calibrate here.',
};
export const kActivities = {
  off: 'The calibration stays as it is.',
  collecting: 'Not calibrated yet: watching how the camera moves.',
  adjusting: 'Computing a calibration.',
  watching: 'Calibrated. New motion is held against the calibration and refines it.',
  doubtful: 'The calibration was withdrawn: it no longer fits what is seen (the log says why). Watching anew.',
};
export const kNeeds = {
  'video': 'It needs video: no picture comes.',
  'telemetry': 'It needs pan/tilt readings: none come.',
  'move the camera': 'Please move the camera.',
  'pan more': 'Please pan the camera more.',
  'tilt more': 'Please tilt the camera more.',
  'accelerate': 'Please vary the speed of the motion.',
  'move farther on both axes': 'Please move farther, to the left and right, up and down.',
  'change speed and direction more and faster': 'Please turn to and fro, and change the speed more.',
  'move faster while the image is read out': 'Please move faster.',
  'let landmarks cross the whole image': 'Please move what is in view across the whole picture, into its corners, too.',
  'scene too plain': 'The scene is too plain: point the camera at something with more detail.',
  'telemetry that describes the motion in the video': 'Readings and video do not agree: check the connection and the signs of the axes.',
  'more of the pictures: the machine is too slow or too busy':
    'Most pictures are never looked at: this machine is too slow, or has too much else to do.',
  'pictures that are not repeated':
    'Pictures are sent again while the camera turns: please set the camera, converter or grabber to the rate at which it takes them.',
  'more of the same motion': 'Please go on moving the camera like this.',
  'a steady zoom': 'Please leave the zoom alone.',
  'video whose delay does not wander':
    'The delay of the video wanders, as behind a relay or Wi-Fi, or where the camera or this machine is too busy: please read the camera itself, by cable.',
  'younger telemetry, or a larger realtime.max_extrapolation_s':
    'Most pictures lie too far beyond the newest trusted pan/tilt angle: see `alidade check`; pan_tilt.rate_hz, pan_tilt.max_repeat_s or realtime.max_extrapolation_s.',
};

// Which link a record says is lost, and what the source says of it.
export const kLost = {'video lost': ['video lost', 'video'], 'telemetry lost': ['pan/tilt lost', 'pan_tilt']};
