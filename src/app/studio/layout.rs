//! Layout of the window: a tree of panes for each workspace. Dragging tabs and borders rearranges it.

pub use super::panels::Pane;

use egui_tiles::{Behavior, Container, Linear, LinearDir, Tabs, Tile, TileId, Tiles, Tree};
use serde::{Deserialize, Serialize};
use std::collections::HashSet;

/// Height of a row of tabs in points.
pub const TABS_HEIGHT: f32 = 24.0;
/// Width of the border between two tiles in points.
pub const BORDER: f32 = 2.0;
/// Margin beside a panel's contents in points.
pub const MARGIN: f32 = 12.0;
/// Width of the light's pane in points.
pub const LIGHT: f32 = 360.0;
/// Height in points of timeline and log: enough for the ruler, and for three lines of the log.
const BELOW: f32 = 112.0;
/// The same where it is narrow: there the log has its buttons above its lines.
const NARROW: f32 = 184.0;
/// The same where light is animated: enough for several lanes or a curve.
const LANES: f32 = 184.0;
/// Height of a timeline without keys: its tabs, its bar and a line of text; and where it is narrow, with the buttons above
/// its bar.
const FOLDED: f32 = 92.0;
const NARROW_FOLDED: f32 = 131.0;
/// Least width and height of the main pane in points, or half the room. The panes beside it shrink first.
const LEAST: [f32; 2] = [400.0, 240.0];

/// A layout of the window.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Workspace {
    /// The mirror ball with its lamps, and the camera's response.
    Calibrate,
    /// The network during training.
    Train,
    /// The relit picture and its light.
    #[default]
    Relight,
    /// The predicted OLATs.
    Review,
    /// Clips.
    Export,
}

impl Workspace {
    /// All workspaces, in the order of a production.
    pub const ALL: [Self; 5] = [Self::Calibrate, Self::Train, Self::Relight, Self::Review, Self::Export];

    /// Label of its tab.
    pub fn name(self) -> &'static str {
        match self {
            Self::Calibrate => "Calibrate",
            Self::Train => "Train",
            Self::Relight => "Relight",
            Self::Review => "Review",
            Self::Export => "Export",
        }
    }

    /// The panes that fill the remaining space. Keys go to the first visible one.
    pub fn main(self) -> &'static [Pane] {
        match self {
            Self::Calibrate => &[Pane::Probe, Pane::Gamma],
            Self::Review => &[Pane::Lamps, Pane::Accuracy],
            Self::Train => &[Pane::Training],
            _ => &[Pane::Picture],
        }
    }

    /// The active pane when the workspace is opened.
    pub fn first(self) -> Pane {
        match self {
            Self::Export => Pane::Export,
            _ => self.main()[0],
        }
    }

    /// Its original layout.
    fn preset(self) -> Tree<Pane> {
        let mut tiles = Tiles::default();
        let root = match self {
            Self::Calibrate => {
                let [project, footage] = [Pane::Project, Pane::Footage].map(|pane| tiles.insert_pane(pane));
                let work = self.main().iter().map(|&pane| tiles.insert_pane(pane));
                let work: Vec<TileId> = work.collect();
                let mut all = Tabs::new([vec![project, footage], work.clone()].concat());
                all.set_active(work[0]);
                let main = tiles.insert_container(all);
                let below = tabs(&mut tiles, &[Pane::Timeline, Pane::Log]);
                divided(&mut tiles, LinearDir::Vertical, &[(main, 0.0), (below, BELOW)])
            }
            Self::Train => {
                let main = tabs(&mut tiles, self.main());
                let picture = tabs(&mut tiles, &[Pane::Picture]);
                let below = tabs(&mut tiles, &[Pane::Timeline, Pane::Log]);
                let right = divided(&mut tiles, LinearDir::Vertical, &[(picture, 900.0), (below, NARROW)]);
                let columns = [(main, 0.0), (right, 400.0)];
                divided(&mut tiles, LinearDir::Horizontal, &columns)
            }
            Self::Export => {
                let main = tabs(&mut tiles, self.main());
                let below = tabs(&mut tiles, &[Pane::Timeline, Pane::Log]);
                let right = tabs(&mut tiles, &[Pane::Export]);
                let left = divided(&mut tiles, LinearDir::Vertical, &[(main, 0.0), (below, BELOW)]);
                let columns = [(left, 0.0), (right, 376.0)];
                divided(&mut tiles, LinearDir::Horizontal, &columns)
            }
            Self::Review => {
                let main = tabs(&mut tiles, self.main());
                let below = tabs(&mut tiles, &[Pane::Timeline, Pane::Log]);
                let picture = tabs(&mut tiles, &[Pane::Picture]);
                let measured = tabs(&mut tiles, &[Pane::Review]);
                let left = divided(&mut tiles, LinearDir::Vertical, &[(main, 0.0), (below, BELOW)]);
                let right = divided(&mut tiles, LinearDir::Vertical, &[(picture, 280.0), (measured, 420.0)]);
                let columns = [(left, 0.0), (right, 440.0)];
                divided(&mut tiles, LinearDir::Horizontal, &columns)
            }
            Self::Relight => {
                let left = tabs(&mut tiles, &[Pane::Environments, Pane::Looks]);
                let main = tabs(&mut tiles, self.main());
                let below = tabs(&mut tiles, &[Pane::Timeline, Pane::Log]);
                let right = tabs(&mut tiles, &[Pane::Light, Pane::Scopes]);
                let middle = divided(&mut tiles, LinearDir::Vertical, &[(main, 0.0), (below, LANES)]);
                let columns = [(left, 208.0), (middle, 0.0), (right, LIGHT)];
                divided(&mut tiles, LinearDir::Horizontal, &columns)
            }
        };
        Tree::new(egui::Id::unique(self.name()), root, tiles)
    }
}

fn tabs(tiles: &mut Tiles<Pane>, panes: &[Pane]) -> TileId {
    let children: Vec<TileId> = panes.iter().map(|&pane| tiles.insert_pane(pane)).collect();
    tiles.insert_tab_tile(children)
}

/// Tiles in a row or a column, with their sizes in points; 0 for the remaining space.
fn divided(tiles: &mut Tiles<Pane>, dir: LinearDir, parts: &[(TileId, f32)]) -> TileId {
    let mut linear = Linear::new(dir, parts.iter().map(|&(tile, _)| tile).collect());
    for &(tile, points) in parts {
        linear.shares.set_share(tile, points);
    }
    tiles.insert_container(linear)
}

/// The layouts of all workspaces.
#[derive(Clone, PartialEq, Serialize, Deserialize)]
pub struct Layout {
    trees: Vec<(Workspace, Tree<Pane>)>,
}

impl Default for Layout {
    fn default() -> Self {
        let preset = |workspace: Workspace| (workspace, workspace.preset());
        Self { trees: Workspace::ALL.map(preset).into() }
    }
}

impl Layout {
    /// No layouts, in place of those that are being drawn.
    pub fn absent() -> Self {
        Self { trees: Vec::new() }
    }

    /// The same, with the original layout for each workspace that is missing or has lost its main panes.
    pub fn mended(mut self) -> Self {
        let whole = |workspace: Workspace, tree: &Tree<Pane>| {
            let main = workspace.main();
            tree.root.is_some() && main.iter().any(|pane| tree.tiles.find_pane(pane).is_some())
        };
        self.trees = Workspace::ALL
            .map(|workspace| {
                let kept = self.trees.iter().find(|(name, _)| *name == workspace);
                let kept = kept.filter(|(_, tree)| whole(workspace, tree)).cloned();
                kept.unwrap_or_else(|| (workspace, workspace.preset()))
            })
            .into();
        self
    }

    fn tree(&mut self, workspace: Workspace) -> &mut Tree<Pane> {
        let place = Workspace::ALL.iter().position(|&one| one == workspace);
        &mut self.trees[place.unwrap_or_default()].1
    }

    /// Restores a workspace's original layout.
    pub fn reset(&mut self, workspace: Workspace) {
        *self.tree(workspace) = workspace.preset();
    }

    /// Shows a pane: brings its tab to the front, or opens it beside the main pane.
    pub fn open(&mut self, workspace: Workspace, pane: Pane) {
        let tree = self.tree(workspace);
        if tree.tiles.find_pane(&pane).is_none() {
            // Beside the picture, whose passes they are.
            let right = (pane == Pane::Effects).then_some(Pane::Light);
            let beside = right.iter().chain(workspace.main()).find_map(|main| {
                let main = tree.tiles.find_pane(main)?;
                tree.tiles.parent_of(main)
            });
            let opened = tree.tiles.insert_pane(pane);
            match beside.or(tree.root).and_then(|id| tree.tiles.get_mut(id)) {
                Some(Tile::Container(container)) => container.add_child(opened),
                _ => return self.reset(workspace),
            }
        }
        tree.make_active(|_, tile| matches!(tile, Tile::Pane(one) if *one == pane));
    }

    /// Closes a pane, unless it is a main pane.
    pub fn close(&mut self, workspace: Workspace, pane: Pane) {
        let tree = self.tree(workspace);
        if let Some(tile) = tree.tiles.find_pane(&pane)
            && !workspace.main().contains(&pane)
        {
            tree.remove_recursively(tile);
        }
    }

    /// Draws a workspace into the remaining space of `ui`. A timeline that `has_no_keys` is folded.
    pub fn ui(
        &mut self,
        (workspace, has_no_keys): (Workspace, bool),
        ui: &mut egui::Ui,
        panes: &mut dyn Behavior<Pane>,
    ) {
        let size = ui.available_rect_before_wrap().size();
        let tree = self.tree(workspace);
        if let Some(root) = tree.root {
            let main: HashSet<TileId> =
                (workspace.main().iter()).filter_map(|pane| tree.tiles.find_pane(pane)).collect();
            let below = timeline_in_front(tree).filter(|_| has_no_keys);
            let below = below.filter(|[rows, _]| holds(&tree.tiles, *rows, &main));
            let unfolded = below.and_then(|[rows, tabs]| {
                // As wide as it was drawn last.
                let is_narrow = tree.tiles.rect(tabs).is_some_and(|rect| !is_wide(rect.width()));
                let height = if is_narrow { NARROW_FOLDED } else { FOLDED };
                Some((rows, tabs, replace_share(tree, rows, tabs, height)?))
            });
            settle(&mut tree.tiles, root, size, &main);
            tree.ui(panes, ui);
            // The layout keeps the height of the lanes.
            if let Some((rows, tabs, height)) = unfolded {
                replace_share(tree, rows, tabs, height);
            }
        }
    }
}

/// True if a timeline pane of this width has its buttons beside its bar.
pub fn is_wide(pane: f32) -> bool {
    pane >= 624.0
}

/// The rows that hold the timeline, and its tabs, while it is in front.
fn timeline_in_front(tree: &Tree<Pane>) -> Option<[TileId; 2]> {
    let timeline = tree.tiles.find_pane(&Pane::Timeline)?;
    let tabs = tree.tiles.parent_of(timeline)?;
    let rows = tree.tiles.parent_of(tabs)?;
    let is_front = matches!(tree.tiles.get(tabs)?,
        Tile::Container(Container::Tabs(tabs)) if tabs.active == Some(timeline));
    let is_below = matches!(tree.tiles.get(rows)?,
        Tile::Container(Container::Linear(rows)) if rows.dir == LinearDir::Vertical);
    (is_front && is_below).then_some([rows, tabs])
}

/// Sets the height of a tile among `rows`, and returns the one before.
fn replace_share(tree: &mut Tree<Pane>, rows: TileId, tile: TileId, height: f32) -> Option<f32> {
    let Some(Tile::Container(Container::Linear(rows))) = tree.tiles.get_mut(rows) else { return None };
    let before = rows.shares[tile];
    rows.shares.set_share(tile, height);
    Some(before)
}

/// Converts the shares of a container into points. The part with a main pane takes the remaining space, so that panels
/// keep their widths as the window grows.
fn settle(tiles: &mut Tiles<Pane>, id: TileId, size: egui::Vec2, main: &HashSet<TileId>) {
    let Some(Tile::Container(container)) = tiles.get(id).cloned() else { return };
    let sizes: Vec<(TileId, egui::Vec2)> = match container {
        Container::Tabs(tabs) => {
            let inner = size - egui::vec2(0.0, TABS_HEIGHT);
            tabs.children.iter().map(|&child| (child, inner)).collect()
        }
        Container::Linear(mut linear) => {
            let axis = usize::from(linear.dir == LinearDir::Vertical);
            let shown: Vec<TileId> =
                (linear.children.iter().copied()).filter(|&child| tiles.is_visible(child)).collect();
            let room = (size[axis] - BORDER * shown.len().saturating_sub(1) as f32).max(1.0);
            if let Some(&flexible) = shown.iter().find(|&&child| holds(tiles, child, main)) {
                let others = shown.iter().filter(|&&child| child != flexible);
                let others: f32 = others.map(|&child| linear.shares[child]).sum();
                let least = LEAST[axis].min(0.5 * room);
                // The others keep their shares, and get their widths back as the window grows.
                let share = if room - others < least { others * least / (room - least) } else { room - others };
                linear.shares.set_share(flexible, share);
            }
            let lengths = linear.shares.split(&shown, room);
            let sizes = shown.into_iter().zip(lengths).map(|(child, length)| {
                let mut inner = size;
                inner[axis] = length;
                (child, inner)
            });
            let sizes = sizes.collect();
            if let Some(Tile::Container(kept)) = tiles.get_mut(id) {
                *kept = Container::Linear(linear);
            }
            sizes
        }
        Container::Grid(_) => Vec::new(),
    };
    for (child, size) in sizes {
        settle(tiles, child, size, main);
    }
}

fn holds(tiles: &Tiles<Pane>, id: TileId, main: &HashSet<TileId>) -> bool {
    let inside = || match tiles.get(id) {
        Some(Tile::Container(container)) => container.children().any(|&child| holds(tiles, child, main)),
        _ => false,
    };
    main.contains(&id) || inside()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_workspace_shows_its_main_pane_and_closed_panes_can_be_opened() {
        for workspace in Workspace::ALL {
            let mut layout = Layout::default();
            for pane in Pane::ALL {
                layout.open(workspace, pane);
                let tree = layout.tree(workspace);
                let tile = tree.tiles.find_pane(&pane).unwrap();
                assert!(tree.active_tiles().contains(&tile), "{workspace:?} {pane:?}");
            }
        }
    }

    #[test]
    fn panes_beside_the_picture_shrink_before_it_and_get_their_widths_back() {
        let mut layout = Layout::default();
        let tree = layout.tree(Workspace::Relight);
        let root = tree.root.unwrap();
        let main = HashSet::from([tree.tiles.find_pane(&Pane::Picture).unwrap()]);
        let mut widths = |width: f32| {
            settle(&mut tree.tiles, root, egui::vec2(width, 600.0), &main);
            let Some(Tile::Container(Container::Linear(columns))) = tree.tiles.get(root) else {
                panic!("the columns");
            };
            let widths = columns.shares.split(&columns.children, width - 2.0 * BORDER);
            widths.into_iter().map(f32::round).collect::<Vec<_>>()
        };
        assert_eq!(widths(1280.0), [208.0, 708.0, LIGHT]);
        assert_eq!(widths(900.0), [182.0, 400.0, 314.0]);
        assert_eq!(widths(1280.0), [208.0, 708.0, LIGHT]);
    }

    #[test]
    fn an_arrangement_is_kept_and_one_that_lost_its_picture_becomes_the_preset() {
        let mut layout = Layout::default();
        layout.open(Workspace::Relight, Pane::Gamma);
        let text = serde_json::to_string(&layout).unwrap();
        let read: Layout = serde_json::from_str(&text).unwrap();
        assert!(read.clone().mended() == layout);

        let mut broken = read;
        let tree = broken.tree(Workspace::Relight);
        let picture = tree.tiles.find_pane(&Pane::Picture).unwrap();
        tree.tiles.remove(picture);
        let mended = broken.mended();
        assert!(mended == Layout::default());
    }
}
