"""Selects a program on this machine to play a file or speak text, and its arguments. Pure."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field

__all__ = ["PLAYERS", "SPEAKERS", "Command", "installable", "play_command", "say_command"]

Which = Callable[[str], "str | None"]


@dataclass(frozen=True)
class Command:
    """A program with its arguments, the text for its stdin, and additions to its environment."""

    words: Sequence[str]
    text: str | None = None
    variables: Mapping[str, str] = field(default_factory=dict)


def _powershell(script: str) -> list[str]:
    return ["-NoProfile", "-NonInteractive", "-Command", script]


# The file is the last argument, except in the PowerShell command, where the script contains it.
PLAYERS: dict[str, Callable[[str, float], list[str]]] = {
    "paplay": lambda file, volume: [f"--volume={round(volume * 65536)}", file],
    "pw-play": lambda file, volume: [f"--volume={volume:.3f}", file],
    "ffplay": lambda file, volume: [
        *("-nodisp", "-autoexit", "-loglevel", "error", "-volume", str(round(volume * 100))),
        file,
    ],
    "gst-play-1.0": lambda file, volume: ["--no-interactive", "--quiet", f"--volume={volume:.3f}", file],
    "afplay": lambda file, volume: ["-v", f"{volume:.3f}", file],
    "aplay": lambda file, volume: ["-q", file],
    "powershell": lambda file, volume: _powershell(
        f"(New-Object Media.SoundPlayer '{file.replace(chr(39), chr(39) * 2)}').PlaySync()"
    ),
}
"""For each player, preferred ones first: a function from a file and a volume (0 to 1) to the player's arguments."""

SPEAKERS: dict[str, Callable[[str, str, float], Command]] = {
    "espeak-ng": lambda text, voice, volume: Command(_espeak(voice, volume), text),
    "espeak": lambda text, voice, volume: Command(_espeak(voice, volume), text),
    "festival": lambda text, voice, volume: Command([*_festival(voice), "--tts"], text),
    "flite": lambda text, voice, volume: Command(["-t", text]),
    "say": lambda text, voice, volume: Command(["-f", "-"], text),
    "powershell": lambda text, voice, volume: Command(
        _powershell(
            "Add-Type -AssemblyName System.Speech; $s = New-Object Speech.Synthesis.SpeechSynthesizer; "
            f"$s.Volume = {round(volume * 100)}; $s.Speak([Console]::In.ReadToEnd())"
        ),
        text,
    ),
}
"""For each program, preferred ones first: a function that returns the command to speak a text."""

_ON_DEVICE: dict[str, Callable[[str], list[str]]] = {
    "paplay": lambda device: [f"--device={device}"],
    "pw-play": lambda device: [f"--target={device}"],
    "aplay": lambda device: ["-D", device],
}
"""Functions that return a player's option for an output device; other programs read the variables of _variables()."""

_DEFAULTS = ("", "default")  # device names that mean the machine's default output
_ALSA = re.compile(r"(?:plug|dmix|sysdefault|front|surround\d+|iec958|hdmi)?(?:hw)?:(?:CARD=)?(\w+)")
_ONLY_ON = {"afplay": "darwin", "say": "darwin", "powershell": "win32"}


def _espeak(voice: str, volume: float) -> list[str]:
    # Names such as voice_kal_diphone are festival's voices, which espeak does not have.
    names = [] if not voice or voice.startswith("voice_") else ["-v", voice]
    return ["--stdin", "-a", str(round(volume * 100)), *names]


def _festival(voice: str) -> list[str]:
    return [f"({voice})"] if voice.startswith("voice_") and voice.replace("_", "").isalnum() else []


def installable(programs: Iterable[str], platform: str) -> list[str]:
    """Return the programs that can be installed on a platform (``sys.platform``)."""
    return [name for name in programs if _ONLY_ON.get(name, platform) == platform]


def play_command(file: str, volume: float, which: Which, device: str = "") -> Command | None:
    """Return the command that plays a file, or None if no player is installed.

    ``device`` is an ALSA name, such as ``hw:1``, or a name of the sound server (default: the machine's output device).
    """
    # Try aplay first, because only aplay accepts ALSA names.
    names = sorted(PLAYERS, key=lambda name: name != "aplay") if _ALSA.match(device) else PLAYERS
    for name in names:
        program = which(name)
        if program:
            option = _ON_DEVICE[name](device) if device not in _DEFAULTS and name in _ON_DEVICE else []
            return Command([program, *option, *PLAYERS[name](file, volume)], None, _variables(device))
    return None


def say_command(text: str, voice: str, volume: float, which: Which, device: str = "") -> Command | None:
    """Return the command that speaks ``text`` on a device, or None if no such program is installed."""
    for name, make in SPEAKERS.items():
        program = which(name)
        if program:
            command = make(text, voice, volume)
            return Command([program, *command.words], command.text, _variables(device))
    return None


def _variables(device: str) -> dict[str, str]:
    """Return environment variables that select an output device, for programs that have no option for it."""
    if device in _DEFAULTS:
        return {}
    if alsa := _ALSA.match(device):
        return {"ALSA_CARD": alsa[1], "AUDIODEV": device, "SDL_AUDIODRIVER": "alsa"}
    return {"PULSE_SINK": device}
