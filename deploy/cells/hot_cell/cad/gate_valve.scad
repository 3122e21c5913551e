// Gate valve with rising stem and spoked handwheel. Pipe axis along x, flange faces at x = ±120, stem along +z.
include <lib.scad>
for (s = [0, 180]) rotate([0, 0, s]) translate([120, 0, 0]) rotate([0, -90, 0]) { flange(100, 22, 8, 80, 20); translate([0, 0, 20]) cylinder(r1 = 64, r2 = 48, h = 30); }
rotate([0, 90, 0]) translate([0, 0, -90]) cylinder(r = 48, h = 180);
hull() { translate([0, 0, -56]) plate([96, 84], 30, 20); translate([0, 0, 60]) plate([112, 96], 34, 20); }
translate([0, 0, 78]) linear_extrude(20) rounded([140, 124], 34);
translate([0, 0, 97]) linear_extrude(20) rounded([140, 124], 34);
for (x = [-1, 1], y = [-1, 1]) translate([56 * x, 48 * y, 116]) bolt(18, 12);
translate([0, 0, 110]) cylinder(r1 = 48, r2 = 26, h = 50);
translate([0, 0, 155]) disc(34, 14, 2);
for (y = [-1, 1]) translate([0, 26 * y, 115]) plate([24, 12], 4, 108);                // yoke
translate([0, 0, 216]) plate([36, 76], 12, 18);
cylinder(r = 10, h = 300, $fn = 20);
translate([0, 0, 250]) disc(24, 26, 3);                                               // hub
translate([0, 0, 262]) {
  rotate_extrude($fn = 56) translate([98, 0]) circle(11, $fn = 16);
  for (i = [0:4]) rotate(72 * i) translate([18, 0, 0]) rotate([0, 90, 0]) cylinder(r1 = 10, r2 = 7, h = 80, $fn = 14);
}
translate([0, 0, 275]) bolt(24, 14);
