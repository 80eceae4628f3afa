//! Polygons of CAD files as triangles.
//!
//! A convex polygon becomes a fan. One that is not convex would turn some triangles of a fan over, so it is cut by ears:
//! a corner is an ear when its triangle turns with the polygon and holds no other corner; ears are cut off one by one.

use crate::diagnostic::Diagnostic;
use crate::geometry::{Point3, Vector3};

/// Most corners of a polygon that is not convex: cutting ears takes the cube of it at worst.
const MOST_CORNERS: usize = 512;
/// A turn to the wrong side by less than this part of the polygon's size squared is rounding in the file.
const FLAT: f64 = 1e-9;

/// How much cutting was done since somebody last looked whether the job goes on.
#[derive(Default)]
pub struct Work(u64);

impl Work {
    /// Corner triples that may be looked at before the next look at the cancel flag: some milliseconds.
    const BETWEEN_LOOKS: u64 = 1 << 21;

    /// Counts a polygon that is to be cut; whether it is time to look.
    pub fn is_due(&mut self, corners: usize) -> bool {
        // A fan of more corners takes no time.
        let corners = corners.clamp(3, MOST_CORNERS) as u64;
        self.0 += corners.pow(3);
        let due = self.0 >= Self::BETWEEN_LOOKS;
        if due {
            self.0 = 0;
        }
        due
    }
}

/// Cuts a polygon into triangles that keep its winding and appends them. A corner that repeats its neighbour is taken
/// once; a polygon with fewer than three distinct corners gives nothing.
///
/// # Errors
/// A polygon that is not convex and has more than 512 corners.
pub fn triangulate(corners: &[u32], vertices: &[Point3], triangles: &mut Vec<[u32; 3]>) -> Result<(), Diagnostic> {
    if let [a, b, c] = *corners {
        push(triangles, [a, b, c]);
        return Ok(());
    }
    let mut ring = corners.to_vec();
    ring.dedup();
    while ring.len() > 1 && ring.first() == ring.last() {
        ring.pop();
    }
    let polygon = Polygon::new(&ring, vertices);
    if (0..ring.len()).all(|k| polygon.turn(&ring, k) >= -polygon.flat) {
        for k in 1..ring.len().saturating_sub(1) {
            push(triangles, [ring[0], ring[k], ring[k + 1]]);
        }
        return Ok(());
    }
    if ring.len() > MOST_CORNERS {
        let message = format!("a face with {} corners that is not convex, expected at most {MOST_CORNERS}", ring.len());
        return Err(Diagnostic::error(message).with_help("export the CAD as triangles"));
    }
    while ring.len() > 3 {
        let ear = polygon.ear(&ring);
        let n = ring.len();
        push(triangles, [ring[(ear + n - 1) % n], ring[ear], ring[(ear + 1) % n]]);
        ring.remove(ear);
    }
    if let [a, b, c] = ring[..] {
        push(triangles, [a, b, c]);
    }
    Ok(())
}

fn push(triangles: &mut Vec<[u32; 3]>, [a, b, c]: [u32; 3]) {
    if a != b && b != c && a != c {
        triangles.push([a, b, c]);
    }
}

struct Polygon<'a> {
    vertices: &'a [Point3],
    /// Unit normal by Newell's sum over the edges; 0 for a polygon without area.
    normal: Vector3,
    /// What counts as no turn, mm².
    flat: f64,
}

impl<'a> Polygon<'a> {
    fn new(ring: &[u32], vertices: &'a [Point3]) -> Self {
        let mut area = Vector3::zeros();
        let mut size_sq = 0.0_f64;
        if let Some(&first) = ring.first() {
            let origin = vertices[first as usize];
            let mut previous = Vector3::zeros();
            for &corner in ring {
                let spoke = vertices[corner as usize] - origin;
                area += previous.cross(&spoke);
                size_sq = size_sq.max(spoke.norm_squared());
                previous = spoke;
            }
        }
        Self { vertices, normal: area.try_normalize(0.0).unwrap_or_default(), flat: FLAT * size_sq }
    }

    /// Twice the signed area of a triangle about the polygon's normal, mm².
    fn area(&self, a: u32, b: u32, c: u32) -> f64 {
        let [a, b, c] = [a, b, c].map(|corner| self.vertices[corner as usize]);
        (b - a).cross(&(c - a)).dot(&self.normal)
    }

    /// How much the ring turns at a place; positive with the polygon.
    fn turn(&self, ring: &[u32], place: usize) -> f64 {
        let n = ring.len();
        self.area(ring[(place + n - 1) % n], ring[place], ring[(place + 1) % n])
    }

    /// The place of an ear; in a ring that crosses itself and has none, the place that turns most.
    fn ear(&self, ring: &[u32]) -> usize {
        let n = ring.len();
        let turns: Vec<f64> = (0..n).map(|place| self.turn(ring, place)).collect();
        let is_ear = |place: usize| {
            let [a, b, c] = [ring[(place + n - 1) % n], ring[place], ring[(place + 1) % n]];
            let inside = |p: u32| {
                let corner = p == a || p == b || p == c;
                !corner && self.area(a, b, p) >= 0.0 && self.area(b, c, p) >= 0.0 && self.area(c, a, p) >= 0.0
            };
            // Only a corner that turns the other way can lie in the triangle of one that turns with the polygon.
            turns[place] > self.flat && !(0..n).any(|other| turns[other] <= self.flat && inside(ring[other]))
        };
        let most = (0..n).max_by(|a, b| turns[*a].total_cmp(&turns[*b])).unwrap_or(0);
        (0..n).find(|place| is_ear(*place)).unwrap_or(most)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Mesh;

    fn cut(outline: &[[f64; 2]]) -> Mesh {
        let vertices: Vec<Point3> = outline.iter().map(|[x, y]| Point3::new(*x, *y, 0.5 * x)).collect();
        let corners: Vec<u32> = (0..vertices.len() as u32).collect();
        let mut triangles = Vec::new();
        triangulate(&corners, &vertices, &mut triangles).unwrap();
        Mesh { vertices, triangles }
    }

    /// Area of the outline in the plane z = x/2, by the shoelace formula times the slope's stretch.
    fn area(outline: &[[f64; 2]]) -> f64 {
        let next = outline.iter().cycle().skip(1);
        let twice: f64 = outline.iter().zip(next).map(|(a, b)| a[0] * b[1] - b[0] * a[1]).sum();
        0.5 * twice.abs() * 1.25_f64.sqrt()
    }

    #[test]
    fn triangles_cover_the_polygon_once_and_keep_its_winding() {
        let star: Vec<[f64; 2]> = (0..20)
            .map(|k| {
                let (sin, cos) = (f64::from(k) * std::f64::consts::TAU / 20.0).sin_cos();
                let radius = if k % 2 == 0 { 10.0 } else { 2.0 };
                [radius * cos, radius * sin]
            })
            .collect();
        let outlines: [&[[f64; 2]]; 5] = [
            &[[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [0.0, 3.0]],
            &[[0.0, 0.0], [4.0, 0.0], [1.0, 1.0], [0.0, 4.0]],
            &[[0.0, 0.0], [9.0, 0.0], [9.0, 9.0], [8.0, 9.0], [8.0, 1.0], [1.0, 1.0], [1.0, 9.0], [0.0, 9.0]],
            &[[0.0, 0.0], [2.0, 0.0], [4.0, 0.0], [4.0, 4.0], [2.0, 4.0], [2.0, 2.0], [0.0, 2.0]],
            &star,
        ];
        for outline in outlines {
            for turned_over in [false, true] {
                let mut outline = outline.to_vec();
                if turned_over {
                    outline.reverse();
                }
                let mesh = cut(&outline);
                let expected = if turned_over { -1.0 } else { 1.0 };
                // A fan over a notch covers it twice, so equal area says both that nothing is missing and nothing twice.
                assert!((mesh.area() - area(&outline)).abs() < 1e-9, "{outline:?}");
                for t in 0..mesh.triangles.len() {
                    assert!(mesh.area_vector_twice(t).z * expected >= -1e-9, "{outline:?}");
                }
                assert!(mesh.triangles.len() <= outline.len() - 2);
            }
        }
    }

    #[test]
    fn repeated_corners_and_crossing_outlines_end() {
        let vertices: Vec<Point3> =
            [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].iter().map(|[x, y]| Point3::new(*x, *y, 0.0)).collect();
        for corners in [&[][..], &[0], &[0, 1], &[0, 0, 0, 0], &[0, 1, 0, 1], &[0, 0, 1, 1, 0]] {
            let mut triangles = Vec::new();
            triangulate(corners, &vertices, &mut triangles).unwrap();
            assert!(triangles.is_empty(), "{corners:?}");
        }
        let mut triangles = Vec::new();
        triangulate(&[0, 1, 1, 2, 3, 0], &vertices, &mut triangles).unwrap();
        assert_eq!(triangles, [[0, 1, 2], [0, 2, 3]]);
        triangulate(&[0, 2, 1, 3], &vertices, &mut triangles).unwrap();
    }

    #[test]
    fn the_cost_of_a_polygon_says_when_to_look_at_the_cancel_flag() {
        let looks = |corners: usize, faces: usize| {
            let mut work = Work::default();
            (0..faces).filter(|_| work.is_due(corners)).count()
        };
        assert_eq!((looks(512, 100), looks(1_000_000, 100), looks(128, 100)), (100, 100, 100));
        // 2^21 / 3^3 triangles.
        assert_eq!((looks(3, 77_672), looks(3, 77_673)), (0, 1));
    }

    #[test]
    fn a_huge_polygon_that_is_not_convex_is_refused() {
        let mut zigzag: Vec<Point3> = (0..600).map(|k| Point3::new(f64::from(k), f64::from(k % 2), 0.0)).collect();
        zigzag.push(Point3::new(300.0, -50.0, 0.0));
        let corners: Vec<u32> = (0..601).collect();
        assert!(triangulate(&corners, &zigzag, &mut Vec::new()).is_err());
    }
}
