"""The package's sounds: short melodies, generated on demand as WAV files."""

from __future__ import annotations

import array
import io
import math
import sys
import wave

from sound_play.msg import SoundRequest

__all__ = ["BUILTIN", "wav_of"]

_RATE = 16000
_NOTE_SECONDS = 0.18

BUILTIN: dict[int, tuple[float, ...]] = {
    SoundRequest.BACKINGUP: (880, 0, 880, 0, 880),
    SoundRequest.NEEDS_UNPLUGGING: (523, 659, 784),
    SoundRequest.NEEDS_PLUGGING: (784, 659, 523),
    SoundRequest.NEEDS_UNPLUGGING_BADLY: (523, 659, 784, 0, 523, 659, 784),
    SoundRequest.NEEDS_PLUGGING_BADLY: (784, 659, 523, 0, 784, 659, 523),
}
"""The notes of each built-in sound, in Hz; 0 is a rest."""


def wav_of(notes: tuple[float, ...]) -> bytes:
    """Return the notes as a mono, 16-bit WAV file; all notes have the same length."""
    count = int(_RATE * _NOTE_SECONDS)
    samples = array.array("h")
    for note in notes:
        for at in range(count):
            # Fade in and out to avoid clicks.
            loudness = min(1.0, at / 200, (count - at) / 200)
            samples.append(int(12000 * loudness * math.sin(2 * math.pi * note * at / _RATE)))
    if sys.byteorder == "big":
        samples.byteswap()
    file = io.BytesIO()
    with wave.open(file, "wb") as sound:
        sound.setnchannels(1)
        sound.setsampwidth(2)
        sound.setframerate(_RATE)
        sound.writeframes(samples.tobytes())
    return file.getvalue()
