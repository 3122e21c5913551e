// Plugged wall port: mounting ring, stepped plug with grip bars. In the plane z = 0, facing +z. Origin: centre, wall.
include <lib.scad>
linear_extrude(14) rounded([460, 460], 40);
for (x = [-1, 1], y = [-1, 1]) translate([195 * x, 195 * y, 13]) bolt(26, 14);
rotate_extrude($fn = 72) polygon([[0, 5], [205, 5], [205, 34], [198, 42], [168, 42], [160, 62], [140, 62], [132, 50], [104, 50], [98, 72], [90, 78], [0, 78]]);
around(16, 183, 11.25) translate([0, 0, 42]) bolt(16, 10);
around(8, 118) translate([0, 0, 49]) bolt(14, 8);
for (a = [0, 180]) rotate(a) translate([52, 0, 77]) rotate([90, 0, 0]) translate([0, 0, -60]) {   // grip bars
  linear_extrude(14) translate([-8, -4]) square([16, 44]);
  translate([0, 0, 106]) linear_extrude(14) translate([-8, -4]) square([16, 44]);
  translate([0, 34, 0]) cylinder(r = 10, h = 120, $fn = 20);
}
