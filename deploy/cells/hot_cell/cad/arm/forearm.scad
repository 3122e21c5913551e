// Forearm, upper half: elbow drum and roll drive. Along −z; roll bearing 200 mm below the origin.
include <../lib.scad>
translate([0, 37, 0]) rotate([90, 0, 0]) disc(38, 74, 4);
translate([0, 0, -60]) cylinder(r1 = 40, r2 = 32, h = 44);
translate([0, 0, -188]) linear_extrude(132) union() { circle(36); for (i = [0:15]) rotate(22.5 * i) translate([34, -1.8]) square([7, 3.6]); }
translate([0, 0, -200]) disc(42, 16, 3);
around(8, 38, 22.5) translate([0, 0, -185]) bolt(6, 4);
translate([-46, 0, -130]) plate([22, 36], 6, 70);             // connector housing
