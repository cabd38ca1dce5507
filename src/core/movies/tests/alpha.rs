//! Alpha and white of every kind of pixels, and matrices that cannot be read.

use super::*;

/// Alpha of a picture for ffmpeg's `geq`: none in the left quarter, half in the second, opaque in the rest.
const STEPS: &str = "if(lt(X,16),0,if(lt(X,32),128,255))";

#[test]
fn alpha_of_webm_is_read_in_any_order() {
    if !test_support::ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    for (name, decoder, coding) in [
        ("8.webm", "libvpx", "-c:v libvpx -auto-alt-ref 0"),
        ("9.webm", "libvpx-vp9", "-c:v libvpx-vp9 -deadline realtime -cpu-used 8"),
    ] {
        let path = folder.path().join(name);
        let filters = format!("format=yuva420p,geq=lum=60+7*N:cb=128:cr=128:a='{STEPS}'");
        let source = ["-f", "lavfi", "-i", "color=black:s=64x48:r=24:d=1", "-vf", &filters];
        let mut words: Vec<&str> = source.to_vec();
        words.extend(coding.split_whitespace());
        words.extend(["-b:v", "2M", "-g", "6", "-pix_fmt", "yuva420p", path.to_str().unwrap()]);
        ffmpeg(&words);
        let movie = Movie::open(&path, &tools(folder.path())).unwrap();
        assert_eq!((movie.info().has_alpha, movie.info().decoder), (true, Some(decoder)));
        for (i, frame) in orders(movie.count().unwrap()).into_iter().enumerate() {
            if i % 7 == 0 {
                movie.forget();
            }
            let read = movie.frame(frame).unwrap();
            let level = f64::from(read.encoded().0.at(60, 24)[0]);
            let wanted = (44.0 + 7.0 * frame as f64) / 219.0;
            assert!((level - wanted).abs() < 0.012, "{name}, frame {frame}: {level}, not {wanted}");
            let alpha = read.alpha().unwrap();
            let found = [4, 24, 60].map(|x| alpha.at(x, 24));
            for (found, wanted) in found.into_iter().zip([0.0, 0.502, 1.0]) {
                assert!((found - wanted).abs() < 0.005, "{name}, frame {frame}: {found}");
            }
            assert_eq!(found[2], 1.0, "{name}");
        }
    }
}

#[test]
fn alpha_that_no_decoder_reads_is_said() {
    if !test_support::ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("matte.webm");
    let source = "color=gray@0.5:s=64x48:r=24:d=0.2,format=yuva420p";
    ffmpeg(&["-f", "lavfi", "-i", source, "-c:v", "libvpx-vp9", path.to_str().unwrap()]);
    let lacking = Tools { ffmpeg: "false".into(), ..tools(folder.path()) };
    let info = Info::read(&path, &lacking).unwrap();
    assert!(!info.has_alpha);
    assert!(info.notes.iter().any(|note| note.contains("libvpx-vp9")), "{:?}", info.notes);
}

#[test]
fn alpha_beside_deep_or_full_colour_is_said_and_the_colour_read() {
    if !test_support::ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let source = "color=gray:s=64x48:r=24:d=0.2";
    for format in ["yuv420p10le", "yuv420p12le", "yuv444p"] {
        let path = folder.path().join(format!("{format}.webm"));
        let words = "-c:v libvpx-vp9 -deadline realtime -cpu-used 8 -metadata:s:v alpha_mode=1 -pix_fmt";
        let mut line = vec!["-f", "lavfi", "-i", source];
        line.extend(words.split(' ').chain([format, path.to_str().unwrap()]));
        ffmpeg(&line);
        let movie = Movie::open(&path, &tools(folder.path())).unwrap();
        let info = movie.info();
        assert_eq!((info.has_alpha, info.decoder, &*info.format), (false, None, format));
        let says = |note: &String| note.contains("without alpha") && note.contains(format);
        assert!(info.notes.iter().any(says), "{:?}", info.notes);
        assert!((movie.frame(1).unwrap().encoded().0.at(30, 24)[0] - 0.5).abs() < 0.01);
    }
}

#[test]
fn white_and_opaque_are_65535_in_every_kind_of_pixels() {
    if !test_support::ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    // Codes of white and of a half, plane by plane, and the half in 16 bits.
    let limited = |bits: u32| {
        let luma = |code: u32| [code << (bits - 8), 128 << (bits - 8), 128 << (bits - 8)];
        (luma(235).to_vec(), luma(126).to_vec(), (126.0 - 16.0) / 219.0)
    };
    let full = |bits: u32| {
        let (most, half) = ((1u32 << bits) - 1, 1u32 << (bits - 1));
        (vec![most, half, half], vec![half; 3], f64::from(half) / f64::from(most))
    };
    let same = |bits: u32, planes: usize| {
        let (most, half) = ((1u32 << bits) - 1, 1u32 << (bits - 1));
        (vec![most; planes], vec![half; planes], f64::from(half) / f64::from(most))
    };
    for (format, bits, range, (white, half, level)) in [
        ("yuv444p", 8, "tv", limited(8)),
        ("yuv444p10le", 10, "tv", limited(10)),
        ("yuv444p12le", 12, "tv", limited(12)),
        ("yuv444p16le", 16, "tv", limited(16)),
        ("yuva444p", 8, "tv", limited(8)),
        ("yuva444p10le", 10, "tv", limited(10)),
        ("yuva444p16le", 16, "tv", limited(16)),
        ("yuv444p", 8, "pc", full(8)),
        ("yuv444p10le", 10, "pc", full(10)),
        ("yuva444p10le", 10, "pc", full(10)),
        ("yuv444p16le", 16, "pc", full(16)),
        ("gray", 8, "pc", same(8, 1)),
        ("gray10le", 10, "pc", same(10, 1)),
        ("gray12le", 12, "pc", same(12, 1)),
        ("gray16le", 16, "pc", same(16, 1)),
        ("gbrp", 8, "pc", same(8, 3)),
        ("gbrp10le", 10, "pc", same(10, 3)),
        ("gbrp12le", 12, "pc", same(12, 3)),
        ("gbrp16le", 16, "pc", same(16, 3)),
        ("gbrap", 8, "pc", same(8, 3)),
        ("gbrap10le", 10, "pc", same(10, 3)),
        ("gbrap12le", 12, "pc", same(12, 3)),
        ("gbrap16le", 16, "pc", same(16, 3)),
    ] {
        let has_alpha = format.contains("yuva") || format.contains("gbrap");
        let opaque = (1u32 << bits) - 1;
        let raw = folder.path().join("raw");
        let mut bytes = Vec::new();
        // The first frame is white and opaque, the second grey and half transparent.
        for (codes, alpha) in [(&white, opaque), (&half, 1 << (bits - 1))] {
            for &code in codes.iter().chain(has_alpha.then_some(&alpha)) {
                let code = &code.to_le_bytes()[..if bits > 8 { 2 } else { 1 }];
                bytes.extend(code.repeat(32 * 16));
            }
        }
        std::fs::write(&raw, bytes).unwrap();
        let path = folder.path().join(format!("{format} {range}.mkv"));
        let source = format!("-f rawvideo -pixel_format {format} -video_size 32x16 -r 24 -i");
        let mut words: Vec<&str> = source.split_whitespace().collect();
        words.push(raw.to_str().unwrap());
        // FFV1 has no planes of RGB in 8 bits.
        let codec = if ["gbrp", "gbrap"].contains(&format) { "utvideo" } else { "ffv1" };
        let coding = format!("-color_range {range} -c:v {codec} -strict experimental");
        words.extend(coding.split_whitespace());
        words.push(path.to_str().unwrap());
        ffmpeg(&words);
        let movie = Movie::open(&path, &tools(folder.path())).unwrap();
        assert_eq!(movie.info().format, format);
        let all = |frame| movie.frame(frame).unwrap().codes.clone();
        assert!(all(0).iter().all(|&code| code == 65535), "{format} {range}: {:?}", &all(0)[..4]);
        for (i, code) in all(1).into_iter().enumerate() {
            let is_alpha = has_alpha && i % 4 == 3;
            let wanted =
                if is_alpha { 65535.0 * f64::from(1 << (bits - 1)) / f64::from(opaque) } else { 65535.0 * level };
            // Eight bits go through ffmpeg's tables of YUV.
            let within = if bits > 8 { 48.0 } else { 80.0 };
            assert!((f64::from(code) - wanted).abs() < within, "{format} {range}: {code}, not {wanted}");
        }
    }
}

#[test]
fn opaque_alpha_of_every_codec_is_exactly_1() {
    if !test_support::ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    for (name, format, coding) in [
        ("prores.mov", "yuva444p10le", "-c:v prores_ks -profile:v 4444 -alpha_bits 16"),
        ("prores8.mov", "yuva444p10le", "-c:v prores_ks -profile:v 4444 -alpha_bits 8"),
        ("animation.mov", "argb", "-c:v qtrle"),
        ("png.mov", "rgba", "-c:v png"),
        ("png16.mov", "rgba64be", "-c:v png"),
        ("grey.mov", "ya8", "-c:v png"),
        ("grey16.mov", "ya16be", "-c:v png"),
        ("utvideo.avi", "gbrap", "-c:v utvideo"),
        ("huffyuv.mkv", "yuva420p", "-c:v ffvhuff"),
    ] {
        let path = folder.path().join(name);
        let source = format!("testsrc2=s=64x48:r=24:d=0.2,format=rgba64le,format={format}");
        let mut words = vec!["-f", "lavfi", "-i", &source];
        words.extend(coding.split_whitespace());
        words.push(path.to_str().unwrap());
        ffmpeg(&words);
        let movie = Movie::open(&path, &tools(folder.path())).unwrap();
        let alpha = movie.frame(1).unwrap().alpha().unwrap();
        assert!(alpha.pixels.iter().all(|&alpha| alpha == 1.0), "{name}: {}", alpha.pixels[0]);
    }
}

#[test]
fn a_matrix_that_cannot_be_read_is_named_with_the_remedy() {
    if !test_support::ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    for (tag, name) in [("ictcp", "ICtCp"), ("ycgco", "YCgCo"), ("bt2020c", "constant luminance")] {
        let path = folder.path().join(format!("{tag}.mkv"));
        let filters = format!("format=yuv444p10le,setparams=colorspace={tag}:range=tv");
        let source = ["-f", "lavfi", "-i", "color=gray:s=64x48:d=0.1", "-vf", &filters];
        let mut words: Vec<&str> = source.to_vec();
        words.extend(["-c:v", "ffv1", "-colorspace", tag, path.to_str().unwrap()]);
        ffmpeg(&words);
        let said = Movie::open(&path, &tools(folder.path())).unwrap_err().to_string();
        assert!(said.contains(name) && said.contains(tag), "{said}");
        assert!(said.contains("zscale"), "{said}");
    }
}
