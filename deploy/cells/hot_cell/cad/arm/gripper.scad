// Parallel gripper, half open. Along −z; finger tips 160 mm below the origin. Fingers apart in x.
include <../lib.scad>
translate([0, 0, -14]) disc(34, 14, 2);
translate([0, 0, -58]) plate([64, 54], 10, 48);
translate([0, 0, -68]) plate([96, 36], 8, 14);                 // slide way
for (s = [-1, 1]) translate([s * 30, 0, 0]) {
  translate([0, 0, -86]) plate([26, 30], 5, 30);
  rotate([90, 0, 0]) translate([0, 0, -10]) linear_extrude(20)
    polygon([[s * 9, -80], [s * 9, -118], [s * -2, -136], [s * -2, -160], [s * -10, -160], [s * -10, -80]]);
  for (i = [0:4]) translate([s * -11, 0, -156 + 6 * i]) rotate([90, 0, 0]) translate([0, 0, -10]) cylinder(r = 2, h = 20, $fn = 8);
}
around(6, 26, 30) translate([0, 0, -13]) mirror([0, 0, 1]) bolt(6, 3);
translate([0, 25, -46]) rotate([-90, 0, 0]) disc(12, 14, 2);   // camera
