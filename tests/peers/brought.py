"""Picture files as other programs write them, with the light that they hold: brought.py FOLDER.

Writes the files and cases.json: for each file its size, the light of every pixel in linear Rec. 709 (or the words of the
refusal), and the tolerance. Colour is by little-cms, files by OpenImageIO, Pillow, tifffile and by hand.
"""

import ctypes
import glob
import json
import os
import site
import struct
import sys
import zlib

import numpy as np
import OpenImageIO as oiio
import tifffile
from PIL import Image

FOLDER = sys.argv[1]
CASES = []

# Colours of 8 × 4 pixels; each pixel differs from every other, so that a turn is seen.
HEIGHT, WIDTH = 4, 8
rng = np.random.default_rng(7)
LIGHT = rng.uniform(0.02, 0.9, (HEIGHT, WIDTH, 3))


def path(name):
    return os.path.join(FOLDER, name)


def case(name, light, tolerance=1e-3, **more):
    light = np.asarray(light, float)
    CASES.append(
        {"file": name, "size": [light.shape[1], light.shape[0]], "light": light.reshape(-1, 3).tolist(), "tolerance": tolerance, **more}
    )


def refused(name, words, **more):
    CASES.append({"file": name, "refused": words, **more})


def srgb(light):
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * np.maximum(light, 1e-9) ** (1 / 2.4) - 0.055)


def linear(code):
    return np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4)


def codes8(light):
    return np.round(255 * np.clip(srgb(light), 0, 1)).astype(np.uint8)


# little-cms, which comes with Pillow.
LCMS = ctypes.CDLL(next(found for folder in site.getsitepackages() for found in glob.glob(folder + "/pillow.libs/*lcms2*")))
for name in ["cmsCreateRGBProfile", "cmsCreateGrayProfile", "cmsBuildGamma", "cmsBuildParametricToneCurve", "cmsCreateTransform", "cmsOpenProfileFromMem"]:
    getattr(LCMS, name).restype = ctypes.c_void_p


class XyY(ctypes.Structure):
    _fields_ = [("x", ctypes.c_double), ("y", ctypes.c_double), ("Y", ctypes.c_double)]


class Triple(ctypes.Structure):
    _fields_ = [("red", XyY), ("green", XyY), ("blue", XyY)]


D65 = (0.3127, 0.3290)
REC709 = [(0.64, 0.33), (0.30, 0.60), (0.15, 0.06)]
ADOBE = [(0.64, 0.33), (0.21, 0.71), (0.15, 0.06)]
P3 = [(0.68, 0.32), (0.265, 0.69), (0.15, 0.06)]
REC2020 = [(0.708, 0.292), (0.170, 0.797), (0.131, 0.046)]
AP1 = [(0.713, 0.293), (0.165, 0.830), (0.128, 0.044)]
ACES_WHITE = (0.32168, 0.33767)


def rgb_profile(primaries, white, curve):
    point = lambda xy: XyY(xy[0], xy[1], 1.0)
    triple = Triple(*[point(p) for p in primaries])
    curves = (ctypes.c_void_p * 3)(curve, curve, curve)
    return ctypes.c_void_p(LCMS.cmsCreateRGBProfile(ctypes.byref(point(white)), ctypes.byref(triple), curves))


def power(gamma):
    LCMS.cmsBuildGamma.argtypes = [ctypes.c_void_p, ctypes.c_double]
    return ctypes.c_void_p(LCMS.cmsBuildGamma(None, gamma))


def srgb_curve():
    parameters = (ctypes.c_double * 5)(2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045)
    return ctypes.c_void_p(LCMS.cmsBuildParametricToneCurve(None, 4, parameters))


def saved(profile):
    size = ctypes.c_uint32(0)
    LCMS.cmsSaveProfileToMem(profile, None, ctypes.byref(size))
    memory = ctypes.create_string_buffer(size.value)
    LCMS.cmsSaveProfileToMem(profile, memory, ctypes.byref(size))
    return memory.raw


RGB_DOUBLE = (1 << 22) | (4 << 16) | (3 << 3)
GRAY_DOUBLE = (1 << 22) | (3 << 16) | (1 << 3)
WORKING = rgb_profile(REC709, D65, power(1.0))


def by_lcms(profile, codes, layout=RGB_DOUBLE):
    """Linear Rec. 709 of codes in [0, 1], relative colorimetric, unbounded."""
    transform = ctypes.c_void_p(LCMS.cmsCreateTransform(profile, layout, WORKING, RGB_DOUBLE, 1, 0x0100 | 0x0040))
    codes = np.ascontiguousarray(codes, float)
    out = np.zeros(codes.shape[:2] + (3,))
    pixels = codes.shape[0] * codes.shape[1]
    pointer = lambda a: a.ctypes.data_as(ctypes.c_void_p)
    LCMS.cmsDoTransform(transform, pointer(codes), pointer(out), ctypes.c_uint32(pixels))
    return out


def png(name, codes, chunks=()):
    """A PNG of 16 bits with chunks before its pixels."""
    height, width = codes.shape[:2]
    kind = {1: 0, 2: 4, 3: 2, 4: 6}[codes.shape[2]]

    def chunk(tag, data):
        return struct.pack(">I", len(data)) + tag + data + struct.pack(">I", zlib.crc32(tag + data))

    rows = b"".join(b"\0" + row.astype(">u2").tobytes() for row in codes)
    body = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 16, kind, 0, 0, 0))
    body += b"".join(chunk(tag, data) for tag, data in chunks)
    body += chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")
    with open(path(name), "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" + body)


def codes16(codes):
    return np.round(65535 * np.clip(codes, 0, 1)).astype(np.uint16)


def chrm(primaries, white):
    values = [v for xy in [white, *primaries] for v in xy]
    return b"cHRM", struct.pack(">8I", *[round(100000 * v) for v in values])


def gama(gamma):
    return b"gAMA", struct.pack(">I", round(100000 * gamma))


def iccp(profile):
    return b"iCCP", b"profile\0\0" + zlib.compress(saved(profile))


# Orientation: blocks of one colour, so that JPEG keeps them.
def orientations():
    blocks = codes8(LIGHT).repeat(16, 0).repeat(16, 1)
    turn = {
        1: lambda a: a,
        2: lambda a: a[:, ::-1],
        3: lambda a: a[::-1, ::-1],
        4: lambda a: a[::-1],
        5: lambda a: a.transpose(1, 0, 2),
        6: lambda a: np.rot90(a, -1),
        7: lambda a: a[::-1, ::-1].transpose(1, 0, 2),
        8: lambda a: np.rot90(a),
    }
    for value, turned in turn.items():
        exif = Image.Exif()
        exif[274] = value
        Image.fromarray(blocks).save(path(f"orientation_{value}.jpg"), quality=100, subsampling=0, exif=exif)
        Image.fromarray(codes8(LIGHT)).save(path(f"orientation_{value}.png"), exif=exif)
        tifffile.imwrite(path(f"orientation_{value}.tif"), codes8(LIGHT), photometric="rgb", extratags=[(274, "H", 1, value, True)])
        seen = linear(np.array(Image.open(path(f"orientation_{value}.jpg"))) / 255)
        case(f"orientation_{value}.jpg", turned(seen), 0.03)
        exact = linear(turned(codes8(LIGHT)) / 255)
        case(f"orientation_{value}.png", exact)
        case(f"orientation_{value}.tif", exact)


def profiles():
    codes = codes16(srgb(LIGHT))
    unit = codes / 65535
    named = {
        "adobe_rgb": rgb_profile(ADOBE, D65, power(2.19921875)),
        "display_p3": rgb_profile(P3, D65, srgb_curve()),
        "rec2020_gamma24": rgb_profile(REC2020, D65, power(2.4)),
        "acescg": rgb_profile(AP1, ACES_WHITE, power(1.0)),
        "srgb": rgb_profile(REC709, D65, srgb_curve()),
    }
    for name, profile in named.items():
        png(f"icc_{name}.png", codes, [iccp(profile)])
        case(f"icc_{name}.png", by_lcms(profile, unit))
        tifffile.imwrite(path(f"icc_{name}.tif"), codes, photometric="rgb", iccprofile=saved(profile))
        case(f"icc_{name}.tif", by_lcms(profile, unit))
    eight = codes8(LIGHT).repeat(16, 0).repeat(16, 1)
    Image.fromarray(eight).save(path("icc_adobe_rgb.jpg"), quality=100, subsampling=0, icc_profile=saved(named["adobe_rgb"]))
    seen = np.array(Image.open(path("icc_adobe_rgb.jpg"))) / 255
    case("icc_adobe_rgb.jpg", by_lcms(named["adobe_rgb"], seen), 0.03)
    # Cameras' EXIF alone: sRGB, the option file of Adobe RGB, and a profile that counts more.
    for name, space, index, profile, right in [
        ("srgb", 1, "R98", None, "srgb"),
        ("adobe_rgb", 0xFFFF, "R03", None, "adobe_rgb"),
        ("uncalibrated", 0xFFFF, "R98", None, "srgb"),
        ("profile_first", 0xFFFF, "R03", "display_p3", "display_p3"),
    ]:
        exif = Image.Exif()
        exif[0x8769] = {0xA001: space, 0xA005: {1: index}}
        exif[274] = 3
        more = {"icc_profile": saved(named[profile])} if profile else {}
        Image.fromarray(eight).save(path(f"exif_{name}.jpg"), quality=100, subsampling=0, exif=exif, **more)
        written = Image.open(path(f"exif_{name}.jpg"))
        assert written.getexif().get_ifd(0xA005)[1].startswith(index)
        said = {"srgb": "sRGB by EXIF", "adobe_rgb": "Adobe RGB (1998) by EXIF", "uncalibrated": "curve not named"}.get(name)
        said = {"said": f"JPEG, 8 bits, {said}, turned by EXIF"} if said else {}
        case(f"exif_{name}.jpg", by_lcms(named[right], np.array(written)[::-1, ::-1] / 255), 0.03, **said)
    white = XyY(0.3457, 0.3585, 1.0)
    grey = ctypes.c_void_p(LCMS.cmsCreateGrayProfile(ctypes.byref(white), power(1.8)))
    png("icc_grey_gamma18.png", codes[:, :, :1], [iccp(grey)])
    case("icc_grey_gamma18.png", np.repeat(unit[:, :, :1] ** 1.8, 3, 2))
    # The chunks of PNG, and which of them counts.
    png("gamma_1.png", codes, [gama(1.0)])
    case("gamma_1.png", unit)
    png("gamma_p3.png", codes, [gama(1 / 2.6), chrm(P3, D65)])
    case("gamma_p3.png", by_lcms(rgb_profile(P3, D65, power(2.6)), unit))
    png("srgb_before_gamma.png", codes, [(b"sRGB", b"\0"), gama(1.0)])
    case("srgb_before_gamma.png", linear(unit))
    png("icc_before_gamma.png", codes, [iccp(named["adobe_rgb"]), gama(1.0)])
    case("icc_before_gamma.png", by_lcms(named["adobe_rgb"], unit))
    png("cicp_before_icc.png", codes, [(b"cICP", bytes([12, 13, 0, 1])), iccp(named["adobe_rgb"])])
    case("cicp_before_icc.png", by_lcms(named["display_p3"], unit))
    to709 = lambda light: by_lcms(rgb_profile(REC2020, D65, power(1.0)), light)
    root = unit ** (32 / 2523)
    pq = (np.maximum(root - 3424 / 4096, 0) / (2413 / 128 - 2392 / 128 * root)) ** (16384 / 2610)
    png("cicp_pq.png", codes, [(b"cICP", bytes([9, 16, 0, 1]))])
    case("cicp_pq.png", to709(pq * 10000 / 203), 0.01, share=True)
    a, b, c = 0.17883277, 0.28466892, 0.55991073
    scene = lambda v: np.where(v <= 0.5, v * v / 3, (np.exp((v - c) / a) + b) / 12)
    png("cicp_hlg.png", codes, [(b"cICP", bytes([9, 18, 0, 1]))])
    case("cicp_hlg.png", to709(scene(unit) / scene(np.array(0.75))), 2e-3)
    png("cicp_linear.png", codes, [(b"cICP", bytes([1, 8, 0, 1]))])
    case("cicp_linear.png", unit)


def exr(name, light, spec=None, names=("R", "G", "B"), **attributes):
    light = np.asarray(light, np.float32)
    spec = spec or oiio.ImageSpec(light.shape[1], light.shape[0], light.shape[2], "float")
    spec.channelnames = names
    for key, value in attributes.items():
        if key == "chromaticities":
            spec.attribute(key, oiio.TypeDesc("float[8]"), [float(v) for v in value])
        else:
            spec.attribute(key, value)
    out = oiio.ImageOutput.create(path(name))
    assert out.open(path(name), spec), oiio.geterror()
    assert out.write_image(light), out.geterror()
    out.close()


def parts(name, each):
    """A file of several parts: names of parts, channels and light."""
    specs = []
    for part, names, light, view in each:
        spec = oiio.ImageSpec(light.shape[1], light.shape[0], light.shape[2], "half")
        spec.channelnames = names
        spec.attribute("oiio:subimagename", part)
        if view:
            spec.attribute("view", view)
        specs.append(spec)
    out = oiio.ImageOutput.create(path(name))
    assert out.open(path(name), specs), oiio.geterror()
    for i, (_, _, light, _) in enumerate(each):
        if i:
            assert out.open(path(name), specs[i], "AppendSubimage")
        assert out.write_image(light.astype(np.float32)), out.geterror()
    out.close()


def luminance_chroma(name, light):
    """An EXR of Y, and of RY and BY at every other column and row, by hand: OpenImageIO has no subsampled channels."""
    height, width = light.shape[:2]
    y = light @ [0.2126, 0.7152, 0.0722]
    planes = [("BY", 2, light[:, :, 2] / y - 1), ("RY", 2, light[:, :, 0] / y - 1), ("Y", 1, y)]
    text = lambda text: text.encode() + b"\0"
    attribute = lambda name, kind, value: text(name) + text(kind) + struct.pack("<i", len(value)) + value
    box = struct.pack("<4i", 0, 0, width - 1, height - 1)
    channels = b"".join(text(name) + struct.pack("<i4B2i", 1, 0, 0, 0, 0, step, step) for name, step, _ in planes) + b"\0"
    header = struct.pack("<II", 20000630, 2) + attribute("channels", "chlist", channels) + attribute("compression", "compression", b"\0")
    header += attribute("dataWindow", "box2i", box) + attribute("displayWindow", "box2i", box) + attribute("lineOrder", "lineOrder", b"\0")
    header += attribute("pixelAspectRatio", "float", struct.pack("<f", 1)) + attribute("screenWindowCenter", "v2f", struct.pack("<2f", 0, 0))
    header += attribute("screenWindowWidth", "float", struct.pack("<f", 1)) + b"\0"
    lines = []
    for row in range(height):
        values = b"".join(plane[row, ::step].astype("<f2").tobytes() for _, step, plane in planes if row % step == 0)
        lines.append(struct.pack("<2i", row, len(values)) + values)
    starts = np.cumsum([len(header) + 8 * height] + [len(line) for line in lines])[:-1]
    with open(path(name), "wb") as file:
        file.write(header + struct.pack(f"<{height}Q", *starts) + b"".join(lines))


def exrs():
    bright = LIGHT * 8
    flat = lambda primaries, white: [v for xy in [*primaries, white] for v in xy]
    for name, primaries, white in [
        ("acescg", AP1, ACES_WHITE),
        ("p3", P3, D65),
        ("xyz", [(1, 0), (0, 1), (0, 0)], (1 / 3, 1 / 3)),
        ("rec709", REC709, D65),
    ]:
        exr(f"chromaticities_{name}.exr", bright, chromaticities=flat(primaries, white))
        if name == "xyz":
            # little-cms takes no primaries with y = 0: Bradford by hand.
            m = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])
            to = np.array([D65[0] / D65[1], 1, (1 - sum(D65)) / D65[1]])
            adapt = np.linalg.inv(m) @ np.diag((m @ to) / (m @ np.ones(3))) @ m
            columns = np.array([[x / y, 1, (1 - x - y) / y] for x, y in REC709]).T
            rgb = columns * np.linalg.solve(columns, to)
            case(f"chromaticities_{name}.exr", bright @ (np.linalg.inv(rgb) @ adapt).T, 8e-3)
        else:
            said = {"acescg": "ACEScg", "p3": "P3 D65", "rec709": "Rec. 709"}[name]
            said = f"EXR, 32 bits, scene-linear, {said} by its chromaticities"
            case(f"chromaticities_{name}.exr", by_lcms(rgb_profile(primaries, white, power(1.0)), bright), 8e-3, said=said)
    grey = np.repeat(LIGHT[:, :, :1] * 0.1, 3, 2)
    several = np.concatenate([grey, bright, LIGHT], 2)
    layers = lambda *names: [f"{layer}.{c}" for layer in names for c in "RGB"]
    exr("blender.exr", several, names=layers("ViewLayer.AO", "ViewLayer.Combined", "ViewLayer.DiffCol"))
    case("blender.exr", bright)
    exr("composite.exr", several, names=layers("ViewLayer.Combined", "Composite.Combined", "ViewLayer.Emit"))
    case("composite.exr", bright)
    exr("beauty.exr", several, names=layers("albedo", "beauty", "specular"))
    case("beauty.exr", bright)
    exr("unnamed_first.exr", several, names=layers("diffuse")[:3] + ["R", "G", "B"] + layers("specular"))
    case("unnamed_first.exr", bright)
    exr("no_picture.exr", several, names=layers("albedo", "normal", "specular"))
    refused("no_picture.exr", "albedo")
    for name, layer in [("layer_specular.exr", "Specular"), ("layer_normal.exr", "normal")]:
        exr(name, several, names=layers("albedo", "normal", "specular"))
        case(name, LIGHT if layer == "Specular" else bright, layer=layer, said=f'EXR, 32 bits, layer "{layer.lower()}", scene-linear')
    exr("layer_missing.exr", several, names=layers("albedo", "beauty", "specular"))
    refused("layer_missing.exr", 'none called "sky": "beauty"', layer="sky")
    exr("layer_before_finished.exr", several, names=layers("beauty", "ViewLayer.sky", "specular"))
    case("layer_before_finished.exr", bright, layer="sky")
    exr("layer_of_one.exr", bright)
    case("layer_of_one.exr", bright, layer="sky", said="EXR, 32 bits, scene-linear")
    luminance_chroma("luminance_chroma.exr", bright)
    refused("luminance_chroma.exr", "luminance and chroma (Y, RY, BY)")
    exr("one_layer.exr", bright, names=layers("sky"))
    case("one_layer.exr", bright)
    exr("grey.exr", bright[:, :, :1], names=["Y"])
    case("grey.exr", np.repeat(bright[:, :, :1], 3, 2))
    half = bright.astype(np.float16).astype(float)
    small = grey.astype(np.float16).astype(float)
    parts("parts.exr", [("ao", ["R", "G", "B"], small, ""), ("beauty", ["R", "G", "B"], half, "")])
    case("parts.exr", half)
    parts("stereo.exr", [("rgba.right", ["R", "G", "B"], small, "right"), ("rgba.left", ["R", "G", "B"], half, "left")])
    case("stereo.exr", half)
    spec = oiio.ImageSpec(4, 2, 3, "float")
    spec.x, spec.y = 2, 1
    spec.full_x, spec.full_y, spec.full_width, spec.full_height = 0, 0, WIDTH, HEIGHT
    exr("data_window.exr", bright[1:3, 2:6], spec)
    window = np.zeros_like(bright)
    window[1:3, 2:6] = bright[1:3, 2:6]
    case("data_window.exr", window)
    exr("htj2k.exr", bright, compression="zip")
    with open(path("htj2k.exr"), "r+b") as file:
        head = file.read()
        at = head.index(b"compression\0compression\0") + 24 + 4
        file.seek(at)
        file.write(bytes([10]))
    refused("htj2k.exr", "ZIP")


def rgbe(light):
    """Codes of Radiance's pixels, and the light that they hold."""
    peak = light.max(2)
    exponent = np.floor(np.log2(peak)).astype(int) + 1
    codes = np.floor(light / 2.0 ** (exponent[..., None] - 8)).astype(np.uint8)
    kept = codes * 2.0 ** (exponent[..., None] - 8)
    return np.concatenate([codes, (exponent + 128).astype(np.uint8)[..., None]], 2), kept


def radiance():
    codes, kept = rgbe(LIGHT * 4)

    def write(name, header, size, pixels, magic="#?RADIANCE"):
        with open(path(name), "wb") as file:
            file.write(f"{magic}\n{header}FORMAT=32-bit_rle_rgbe\n\n{size}\n".encode() + np.ascontiguousarray(pixels).tobytes())

    plain = f"-Y {HEIGHT} +X {WIDTH}"
    write("plain.hdr", "", plain, codes)
    case("plain.hdr", kept)
    write("rgbe_magic.hdr", "", plain, codes, "#?RGBE")
    case("rgbe_magic.hdr", kept)
    write("exposure.hdr", "EXPOSURE=2\nEXPOSURE=0.25\n", plain, codes)
    case("exposure.hdr", kept / 0.5)
    write("colorcorr.hdr", "COLORCORR=2 1 0.5\n", plain, codes)
    case("colorcorr.hdr", kept / [2, 1, 0.5])
    numbers = " ".join(str(v) for xy in [*P3, D65] for v in xy)
    write("primaries.hdr", f"PRIMARIES={numbers}\n", plain, codes)
    case("primaries.hdr", by_lcms(rgb_profile(P3, D65, power(1.0)), kept), 4e-3)
    for name, size, pixels in [
        ("up", f"+Y {HEIGHT} +X {WIDTH}", codes[::-1]),
        ("left", f"-Y {HEIGHT} -X {WIDTH}", codes[:, ::-1]),
        ("turned", f"+Y {HEIGHT} -X {WIDTH}", codes[::-1, ::-1]),
        ("columns", f"+X {WIDTH} -Y {HEIGHT}", codes.transpose(1, 0, 2)),
        ("columns_up", f"+X {WIDTH} +Y {HEIGHT}", codes[::-1].transpose(1, 0, 2)),
        ("columns_left", f"-X {WIDTH} -Y {HEIGHT}", codes[:, ::-1].transpose(1, 0, 2)),
        ("columns_turned", f"-X {WIDTH} +Y {HEIGHT}", codes[::-1, ::-1].transpose(1, 0, 2)),
    ]:
        write(f"order_{name}.hdr", "", size, pixels)
        case(f"order_{name}.hdr", kept)


def tiffs():
    bright = LIGHT * 8
    for name, kind in [("half", np.float16), ("float", np.float32), ("double", np.float64)]:
        values = bright.astype(kind)
        tifffile.imwrite(path(f"{name}.tif"), values, photometric="rgb")
        case(f"{name}.tif", values.astype(float))
    tifffile.imwrite(path("float_planar.tif"), bright.astype(np.float32).transpose(2, 0, 1), photometric="rgb", planarconfig="separate")
    case("float_planar.tif", bright)
    tifffile.imwrite(path("float_deflate.tif"), bright.astype(np.float32), photometric="rgb", compression="zlib")
    case("float_deflate.tif", bright)
    code = srgb(LIGHT)
    for name, kind in [("uint8", np.uint8), ("uint16", np.uint16), ("uint32", np.uint32)]:
        most = np.iinfo(kind).max
        values = np.round(code * most).astype(kind)
        exact = linear(values / most)
        tifffile.imwrite(path(f"{name}.tif"), values, photometric="rgb")
        case(f"{name}.tif", exact)
        tifffile.imwrite(path(f"{name}_planar.tif"), values.transpose(2, 0, 1), photometric="rgb", planarconfig="separate")
        case(f"{name}_planar.tif", exact)
        tifffile.imwrite(path(f"{name}_big.tif"), values, photometric="rgb", bigtiff=True, byteorder=">")
        case(f"{name}_big.tif", exact)
    tifffile.imwrite(path("grey32.tif"), LIGHT[:, :, 0].astype(np.float32), photometric="minisblack")
    case("grey32.tif", np.repeat(LIGHT[:, :, :1], 3, 2))
    # OpenImageIO's own build has no ZSTD, so the file only says so.
    tifffile.imwrite(path("zstd.tif"), codes16(code), photometric="rgb", compression="zlib")
    with tifffile.TiffFile(path("zstd.tif"), mode="r+b") as file:
        file.pages[0].tags["Compression"].overwrite(50000)
    refused("zstd.tif", "ZSTD")


def raws():
    tiny = codes8(LIGHT)
    tifffile.imwrite(path("camera.tif"), tiny, photometric="rgb", extratags=[(50706, "B", 4, (1, 4, 0, 0), True)])
    refused("camera.tif", "camera raw")
    for ending in ["nef", "arw", "cr2", "dng"]:
        tifffile.imwrite(path("camera." + ending), tiny, photometric="rgb")
        refused("camera." + ending, "Develop")
    with open(path("camera.cr3"), "wb") as file:
        file.write(b"\0\0\0\x18ftypcrx \0\0\0\1crx isom" + bytes(64))
    refused("camera.cr3", "Develop")
    with open(path("camera.raf"), "wb") as file:
        file.write(b"FUJIFILMCCD-RAW 0201" + bytes(64))
    refused("camera.raf", "Develop")


for made in [orientations, profiles, exrs, radiance, tiffs, raws]:
    made()
with open(path("cases.json"), "w") as file:
    json.dump(CASES, file)
print(f"{len(CASES)} cases")
