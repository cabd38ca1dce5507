//! Interview of the demo, traced once by the stage itself (`make demo-interview`) and kept in `assets/interview`: at
//! 540 × 960 pixels a frame takes a small computer ten seconds.

/// A frame as a JPEG, and its matte as a PNG.
pub struct ShippedFrame {
    pub picture: &'static [u8],
    pub matte: &'static [u8],
}

macro_rules! frames {
    ($($number:literal)*) => {
        [$(ShippedFrame {
            picture: include_bytes!(concat!("../../../assets/interview/frame_", $number, ".jpg")),
            matte: include_bytes!(concat!("../../../assets/interview/frame_", $number, ".png")),
        }),*]
    };
}

/// Interview of [`demo`](super::StageSettings::demo).
pub static FRAMES: [ShippedFrame; 24] = frames! {
    "000" "001" "002" "003" "004" "005" "006" "007" "008" "009" "010" "011"
    "012" "013" "014" "015" "016" "017" "018" "019" "020" "021" "022" "023"
};
