// Overhead rail of the gantry, base of the arm. Along x, centred; joint 1 slides 40 mm below the origin.
include <../lib.scad>
rotate([90, 0, 90]) translate([0, 0, -700]) linear_extrude(1400) difference() {
  translate([0, 8]) square([150, 70], center = true);
  translate([0, 12]) square([110, 42], center = true);
  translate([0, -27]) square([46, 40], center = true);        // slot that the carriage hangs from
}
for (x = [-700, 690]) translate([x + 5, 0, -27]) rotate([0, 0, 0]) block(18, 160, 70);
for (x = [-500, 0, 500]) translate([x, 0, 42]) plate([180, 190], 12, 8);
for (x = [-500, 0, 500], i = [-1, 1], j = [-1, 1]) translate([x + 70 * i, 84 * j, 43]) mirror([0, 0, 1]) bolt(16, 10);
for (y = [-1, 1]) translate([-690, 78 * y, 14]) rod_x(8, 1380);   // linear guides
