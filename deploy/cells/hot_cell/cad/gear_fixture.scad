// Spur gear on a shaft between two bearing blocks. Shaft along y. Origin: underside, centre.
include <lib.scad>
teeth = 28; module_mm = 7; rp = teeth * module_mm / 2; axis = 130;
function tooth(i) = [for (p = [[-0.30, -1.25], [-0.20, 0], [-0.10, 1], [0.10, 1], [0.20, 0], [0.30, -1.25]]) let (a = 360 / teeth * (i + p[0] * 1.12), r = rp + module_mm * p[1]) [r * cos(a), r * sin(a)]];
linear_extrude(16) difference() { rounded([210, 170], 12); for (x = [-1, 1], y = [-1, 1]) translate([88 * x, 68 * y]) circle(7); }
translate([0, 16, axis]) rotate([90, 0, 0]) linear_extrude(32) difference() {
  polygon([for (i = [0:teeth - 1], p = tooth(i)) p]);
  for (i = [0:5]) rotate(60 * i + 30) translate([54, 0]) circle(17, $fn = 24);
}
translate([0, 24, axis]) rotate([90, 0, 0]) disc(30, 48, 3);
translate([0, -105, axis]) rod_y(14, 210);
for (s = [-1, 1]) translate([0, s * 62 + 14, 0]) {
  rotate([90, 0, 0]) linear_extrude(28) union() { hull() { translate([0, axis]) circle(30); translate([0, 30]) square([110, 30], center = true); } }
  translate([0, -14, 0]) for (x = [-62, 62]) translate([x, 0, 15]) { block(30, 28, 16); translate([0, 0, 15]) bolt(14, 8); }
}
