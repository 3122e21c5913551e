// Shapes that several parts of the cell share. Millimetres, z up. Overlaps of 1 mm (`eps`) keep unions free of
// faces that merely touch: every exported mesh must be closed.
eps = 1;
$fn = 36;

// Flat outline with rounded corners, centred.
module rounded(size, r) { offset(r, $fn = 16) square([size[0] - 2 * r, size[1] - 2 * r], center = true); }
// Plate standing on z = 0.
module plate(size, r, h) { linear_extrude(h) rounded(size, r); }
// Box standing on z = 0, centred in x and y.
module block(x, y, z) { translate([-x / 2, -y / 2, 0]) cube([x, y, z]); }
// Cylinder on z = 0 with bevelled rims.
module disc(r, h, bevel = 2) {
  rotate_extrude() polygon([[0, 0], [r - bevel, 0], [r, bevel], [r, h - bevel], [r - bevel, h], [0, h]]);
}
// Cylinder along +x from x = 0.
module rod_x(r, l) { rotate([0, 90, 0]) cylinder(r = r, h = l); }
// Cylinder along +y from y = 0.
module rod_y(r, l) { rotate([-90, 0, 0]) cylinder(r = r, h = l); }
// children() at n places on a circle, the first at `start` degrees.
module around(n, r, start = 0) { for (i = [0:n - 1]) rotate(start + 360 * i / n) translate([r, 0, 0]) children(); }
// Hexagon bolt head on z = 0, sunk by eps.
module bolt(across, h) { translate([0, 0, -eps]) cylinder(d = across * 1.1547, h = h + eps, $fn = 6); }
// Flange disc on z = 0 with a ring of bolt heads on top.
module flange(r, t, n, r_bolts, across) {
  disc(r, t, 2);
  around(n, r_bolts, 180 / n) translate([0, 0, t]) bolt(across, across * 0.6);
}
