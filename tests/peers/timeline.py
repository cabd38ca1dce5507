#!/usr/bin/env python3
"""A timeline as read by OpenTimelineIO: timeline.py FILE.otio | FILE.edl FRAMES/SECONDS

Prints one JSON object: the timeline's name and start, and each clip with its track, range, time code, reel and media."""

import json
import sys

import opentimelineio as otio

path = sys.argv[1]
options = {}
if path.endswith(".edl"):
    frames, seconds = sys.argv[2].split("/")
    options["rate"] = int(frames) / int(seconds)
timeline = otio.adapters.read_from_file(path, **options)


def time(value):
    return None if value is None else [value.value, value.rate]


def codes(value):
    """The time code in non-drop and drop-frame form, if the rate has it."""
    found = [otio.opentime.to_timecode(value, value.rate, False)]
    if round(value.rate) % 30 == 0 and value.rate % 1:
        found.append(otio.opentime.to_timecode(value, value.rate, True))
    return found


def media(reference):
    found = {"kind": reference.schema_name(), "range": None}
    if reference.available_range is not None:
        found["range"] = [
            time(reference.available_range.start_time),
            time(reference.available_range.duration),
        ]
    if isinstance(reference, otio.schema.ImageSequenceReference):
        count = reference.number_of_images_in_sequence()
        found["urls"] = [reference.target_url_for_image_number(i) for i in range(count)]
    elif isinstance(reference, otio.schema.ExternalReference):
        found["urls"] = [reference.target_url]
    return found


def clip(track, item):
    return {
        "name": item.name,
        "track": track.kind,
        "start": time(item.source_range.start_time),
        "duration": time(item.source_range.duration),
        "codes": codes(item.source_range.start_time),
        "reel": item.metadata.get("cmx_3600", {}).get("reel"),
        "media": media(item.media_reference),
    }


print(
    json.dumps(
        {
            "name": timeline.name,
            "start": time(timeline.global_start_time),
            "clips": [clip(track, item) for track in timeline.tracks for item in track],
        }
    )
)
