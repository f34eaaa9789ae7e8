//! An SVG becomes pixels, or a PNG, with the font that the program carries.

use resvg::tiny_skia::{Color, Pixmap, Transform};
use resvg::usvg::{Options, Tree};

use super::letters::LETTERS;

/// Renders with as many pixels for a \[px\] of the sheet as `zoom` says of its width. The error is a reason.
pub fn render(svg: &str, zoom: impl FnOnce(f32) -> f32) -> Result<Vec<u8>, String> {
    let tree = tree(svg)?;
    let zoom = zoom(tree.size().width());
    let size = [tree.size().width(), tree.size().height()].map(|length| (zoom * length).round() as u32);
    let Picture { rgba, .. } = picture(tree, zoom, size)?;
    // tiny-skia's own encoder makes a copy to divide by transparency, which a sheet on white paper has not.
    encoded(size, &rgba).map_err(|error| error.to_string())
}

fn encoded([width, height]: [u32; 2], rgba: &[u8]) -> Result<Vec<u8>, png::EncodingError> {
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, width, height);
    encoder.set_color(png::ColorType::Rgba);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(rgba)?;
    writer.finish()?;
    Ok(file)
}

fn tree(svg: &str) -> Result<Tree, String> {
    Tree::from_str(&LETTERS.outlined(svg), &Options::default()).map_err(|error| error.to_string())
}

/// A sheet on white paper; the tree goes before anything is made of its picture.
fn picture(tree: Tree, zoom: f32, size: [u32; 2]) -> Result<Picture, String> {
    let [width, height] = size;
    let pixmap = Pixmap::new(width, height);
    let mut pixmap = pixmap.ok_or_else(|| format!("no image of {width} x {height} pixels"))?;
    pixmap.fill(Color::WHITE);
    resvg::render(&tree, Transform::from_scale(zoom, zoom), &mut pixmap.as_mut());
    Ok(Picture { size, rgba: pixmap.take() })
}

/// An opaque picture of an even number of pixels each way, as videos ask for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    pub size: [u32; 2],
    /// Red, green, blue and 255 of each pixel, row by row.
    pub rgba: Vec<u8>,
}

/// Paints a sheet with `zoom` pixels for each of its \[px\]. The error is a reason.
pub fn paint(svg: &str, zoom: f32) -> Result<Picture, String> {
    let tree = tree(svg)?;
    let even = |length: f32| 2 * (0.5 * zoom * length).ceil() as u32;
    let size = [even(tree.size().width()), even(tree.size().height())];
    picture(tree, zoom, size)
}
