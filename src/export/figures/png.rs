//! An SVG becomes a PNG, with the font that the program carries.

use std::sync::Arc;

use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::{Options, Tree, fontdb};

/// Renders at `width` pixels; the height follows from the drawing's shape. The error is a reason.
pub fn render(svg: &str, width: u32) -> Result<Vec<u8>, String> {
    let mut options = Options { font_family: "DejaVu Sans".into(), ..Options::default() };
    let font = fontdb::Source::Binary(Arc::new(dejavu::sans::regular()));
    options.fontdb_mut().load_font_source(font);
    let tree = Tree::from_str(svg, &options).map_err(|error| error.to_string())?;
    let zoom = width as f32 / tree.size().width();
    let height = (tree.size().height() * zoom).round() as u32;
    let mut pixmap =
        Pixmap::new(width, height).ok_or_else(|| format!("no image of {width} x {height} pixels"))?;
    resvg::render(&tree, Transform::from_scale(zoom, zoom), &mut pixmap.as_mut());
    pixmap.encode_png().map_err(|error| error.to_string())
}
