//! A finished shoot as movies, made with ffmpeg: the form in which a camera would deliver it.

use super::StageSettings;
use base::error::{Error, Result};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Form of the shoot's pictures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum WrittenAs {
    /// One PNG per picture.
    #[default]
    Files,
    /// ProRes 4444 through ffmpeg: `interview.mov` with sound and time code, `exemplars/POSE.mov` with the lamps in
    /// turn, and `probes.mov`.
    Movies,
}

/// Time code of the interview's first frame.
const TIME_CODE: &str = "01:00:00:00";

/// Replaces the pictures of the shoot in `folder` with movies. `before_lamp` lists the lamps before which each pose's
/// tracking frames were taken. Mattes stay files, renamed after the movie's frames.
///
/// # Errors
/// When ffmpeg is missing or fails, or a file cannot be replaced.
pub fn film(folder: &Path, settings: &StageSettings, poses: usize, before_lamp: &[usize]) -> Result<()> {
    let at = |name: String| folder.join(name);
    let digits = settings.lamps.saturating_sub(1).to_string().len().max(2);
    let olat = |lamp: usize| format!("olat_{lamp:0digits$}.png");
    let frames = (0..settings.frames).map(|frame| at(format!("interview/frame_{frame:03}.png")));
    encode(&frames.collect::<Vec<_>>(), &at("interview.mov".into()), true)?;
    for pose in 0..poses {
        let mut pictures = Vec::new();
        for lamp in 0..=settings.lamps {
            let tracking = before_lamp.iter().position(|&before| before == lamp);
            pictures.extend(tracking.map(|k| at(format!("tracking/pose{pose:02}/frame_{k:02}.png"))));
            if lamp < settings.lamps {
                pictures.push(at(format!("exemplars/pose{pose:02}/{}", olat(lamp))));
            }
        }
        encode(&pictures, &at(format!("exemplars/pose{pose:02}.mov")), false)?;
        remove(&at(format!("exemplars/pose{pose:02}")))?;
    }
    let balls: Vec<PathBuf> = (0..settings.lamps).map(|lamp| at(format!("probes/{}", olat(lamp)))).collect();
    encode(&balls, &at("probes.mov".into()), false)?;
    for ball in &balls {
        std::fs::remove_file(ball).map_err(|e| refused("remove", ball, e))?;
    }
    for frame in 0..settings.frames {
        let mask = at(format!("interview_masks/frame_{frame:03}.png"));
        let renamed = at(format!("interview_masks/frame_{frame:06}.png"));
        std::fs::rename(&mask, renamed).map_err(|e| refused("move", &mask, e))?;
    }
    for part in ["interview", "tracking"].map(|part| folder.join(part)) {
        if part.exists() {
            remove(&part)?;
        }
    }
    Ok(())
}

fn remove(folder: &Path) -> Result<()> {
    std::fs::remove_dir_all(folder).map_err(|e| refused("remove", folder, e))
}

fn refused(action: &'static str, path: &Path, e: std::io::Error) -> Error {
    Error::io(action, path, e, "Check that the folder can be written")
}

/// Encodes PNGs of one size at 24 frames a second; `with_sound` adds a tone and a time code.
fn encode(pictures: &[PathBuf], movie: &Path, with_sound: bool) -> Result<()> {
    const REMEDY: &str = "Install ffmpeg with the encoder prores_ks, or write files";
    let mut command = Command::new("ffmpeg");
    command.args(["-v", "error", "-y", "-f", "image2pipe", "-c:v", "png", "-framerate", "24", "-i", "pipe:0"]);
    let seconds = pictures.len() as f64 / 24.0;
    if with_sound {
        command.args(["-f", "lavfi", "-i", &format!("sine=frequency=440:sample_rate=48000:duration={seconds:.6}")]);
        command.args(["-c:a", "pcm_s16le", "-timecode", TIME_CODE]);
    }
    let tags = "scale=out_color_matrix=bt709:out_range=limited:flags=accurate_rnd+full_chroma_int,format=yuv444p10le,\
                setparams=colorspace=bt709:color_primaries=bt709:color_trc=bt709:range=tv";
    command.args(["-vf", tags, "-c:v", "prores_ks", "-profile:v", "4", "-f", "mov"]);
    let mut name = std::ffi::OsString::from("file:");
    name.push(movie);
    let child = command.arg(name).stdin(Stdio::piped()).stdout(Stdio::null()).spawn();
    let mut child = child.map_err(|e| match e.kind() {
        ErrorKind::NotFound => Error::missing("ffmpeg was not found; it is needed for writing movies", REMEDY),
        _ => Error::io("start", "ffmpeg", e, REMEDY),
    })?;
    let fed = child.stdin.take().map_or(Ok(()), |mut stdin| {
        pictures.iter().try_for_each(|picture| std::io::copy(&mut base::files::open(picture)?, &mut stdin).map(drop))
    });
    let ended = child.wait();
    fed.map_err(|e| refused("write", movie, e))?;
    match ended {
        Ok(status) if status.success() => Ok(()),
        _ => Err(Error::codec("write", movie, "ffmpeg refused it", REMEDY)),
    }
}
