// Wrist block with the tool roll drive. Along −z; tool flange 90 mm below the origin.
include <../lib.scad>
translate([0, 29, 0]) rotate([90, 0, 0]) disc(28, 58, 3);
translate([0, 0, -40]) cylinder(r1 = 32, r2 = 26, h = 30);
translate([0, 0, -80]) linear_extrude(44) union() { circle(32); for (i = [0:11]) rotate(30 * i) translate([30, -1.6]) square([5, 3.2]); }
translate([0, 0, -90]) disc(34, 14, 2);
translate([38, 0, -72]) plate([18, 26], 5, 34);
