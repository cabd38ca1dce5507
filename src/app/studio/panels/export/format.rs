//! The file format and its options.

use super::choice::{LIST, option_ui};
use crate::export_options::ExportOptions;
use crate::panels::widgets::rows::segments_ui;
use egui::{ComboBox, Ui, WidgetText};
use export::{Codec, ExrAlpha, ExrCompression, Format, LayerFiles, MovieAlpha, Samples};

pub fn ui(ui: &mut Ui, options: &mut ExportOptions) {
    ui.label("Format");
    segments_ui(ui, |ui| {
        ui.spacing_mut().button_padding.x = 6.0;
        for format in [Format::Png8, Format::Png16, Format::Tiff, Format::Exr] {
            let (name, hint) = (format.name(), format.describe());
            if option_ui(ui, "Format", name, hint, options.format == format) {
                options.format = format;
            }
        }
        let hint = "All frames in one file, with the interview's sound and time code";
        if option_ui(ui, "Format", "Movie", hint, options.format.is_movie()) {
            options.format = Format::Movie(options.format.codec().unwrap_or(Codec::H264));
        }
    });
    ui.end_row();
    if options.format.is_movie() {
        codec_ui(ui, options);
    }
    if options.format == Format::Exr {
        exr_ui(ui, options);
    }
}

fn codec_ui(ui: &mut Ui, options: &mut ExportOptions) {
    ui.label("Codec");
    ui.horizontal(|ui| {
        let movies = Format::ALL.into_iter().filter(|format| format.is_movie());
        let names = movies.map(|format| (format, format.name(), format.describe()));
        list_ui(ui, "Codec", options.format.name(), &mut options.format, names);
        ui.checkbox(&mut options.sound, "Sound")
            .on_hover_text("The sound of the interview's movie, cut to the exported frames");
    });
    ui.end_row();
    // Rows keep their places: nothing under the pointer moves.
    let has_alpha = options.format.codec().is_some_and(Codec::has_alpha);
    ui.label("Matte");
    ui.add_enabled_ui(has_alpha, |ui| {
        segments_ui(ui, |ui| {
            for (alpha, name, hint) in [
                (MovieAlpha::Straight, "Straight", "Unpremultiplied, as most editors expect"),
                (MovieAlpha::Premultiplied, "Premultiplied", "Codes times alpha, over black"),
            ] {
                if option_ui(ui, "Matte", name, hint, options.movie_alpha == alpha) {
                    options.movie_alpha = alpha;
                }
            }
        });
    });
    ui.end_row();
}

fn exr_ui(ui: &mut Ui, options: &mut ExportOptions) {
    let exr = &mut options.exr;
    ui.label("EXR");
    ui.horizontal(|ui| {
        let samples = [(Samples::Half, "Half", "16 bits: enough for pictures"), (Samples::Float, "Float", "32 bits")];
        segments_ui(ui, |ui| {
            for (samples, name, hint) in samples {
                if option_ui(ui, "Samples", name, hint, exr.samples == samples) {
                    exr.samples = samples;
                }
            }
        });
        let all = ExrCompression::ALL.map(|c| (c, c.name(), hint(c)));
        list_ui(ui, "Compression", exr.compression.name(), &mut exr.compression, all.into_iter());
    });
    ui.end_row();
    ui.label("Matte");
    ui.horizontal(|ui| {
        let alphas = [
            (ExrAlpha::Premultiplied, "Premultiplied", "Colour times alpha, as OpenEXR defines it"),
            (ExrAlpha::Straight, "Straight", "Colour divided by alpha"),
        ];
        segments_ui(ui, |ui| {
            for (alpha, name, hint) in alphas {
                if option_ui(ui, "Matte", name, hint, exr.alpha == alpha) {
                    exr.alpha = alpha;
                }
            }
        });
        ui.checkbox(&mut exr.crop, "Crop").on_hover_text("Crops empty borders with the file's data window");
    });
    ui.end_row();
    ui.label("Layers in");
    ui.add_enabled_ui(options.layers, |ui| {
        let places = [
            (LayerFiles::Channels, "Channels", "Beside the picture's channels"),
            (LayerFiles::Parts, "Parts", "A part of the file for each layer"),
            (LayerFiles::Files, "Files", "A file for each layer beside the picture's"),
        ];
        segments_ui(ui, |ui| {
            for (layers, name, hint) in places {
                if option_ui(ui, "Layers in", name, hint, exr.layers == layers) {
                    exr.layers = layers;
                }
            }
        });
    });
    ui.end_row();
    ui.label("");
    ui.add_enabled_ui(options.layers, |ui| {
        ui.checkbox(&mut exr.weights, "JSON of weights")
            .on_hover_text("A JSON file with the layers' weights beside each picture");
    });
    ui.end_row();
}

fn hint(compression: ExrCompression) -> &'static str {
    match compression {
        ExrCompression::None => "Not compressed",
        ExrCompression::Rle => "Run lengths: fast, and small where nothing changes",
        ExrCompression::Zips => "Single lines: read fastest by compositing programs",
        ExrCompression::Zip => "16 lines at a time: small without loss",
        ExrCompression::Piz => "Wavelets: smallest without loss for grain",
        ExrCompression::Pxr24 => "32-bit numbers are rounded to 24 bits",
    }
}

/// A drop-down list with a name for screen readers.
fn list_ui<T: PartialEq>(
    ui: &mut Ui,
    name: &str,
    shown: &str,
    chosen: &mut T,
    all: impl Iterator<Item = (T, &'static str, &'static str)>,
) {
    let list = ComboBox::from_id_salt(name).width(LIST).selected_text(shown);
    let response = list.show_ui(ui, |ui| {
        for (value, choice, hint) in all {
            ui.selectable_value(chosen, value, WidgetText::from(choice)).on_hover_text(hint);
        }
    });
    let text = format!("{name}: {shown}");
    let combo = egui::Role::ComboBox;
    (response.response).widget_info(|| egui::WidgetInfo::labeled(combo, true, &text));
}
