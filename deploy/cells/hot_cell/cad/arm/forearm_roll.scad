// Forearm, lower half, which rolls: tapered tube and wrist fork. Along −z; wrist axis along y, 200 mm below the origin.
include <../lib.scad>
translate([0, 0, -16]) disc(40, 16, 3);
translate([0, 0, -150]) cylinder(r1 = 29, r2 = 34, h = 138, $fn = 40);
for (z = [-60, -110]) translate([0, 0, z]) disc(36, 10, 2);
translate([0, 0, -160]) plate([58, 84], 12, 18);
for (s = [-1, 1]) translate([0, s * 36 + 6, 0]) rotate([90, 0, 0]) linear_extrude(12) hull() { translate([0, -200]) circle(28); translate([-28, -156]) square([56, 4]); }
for (s = [-1, 1]) rotate([0, 0, s > 0 ? 0 : 180]) translate([0, 41, -200]) rotate([-90, 0, 0]) { disc(22, 10, 3); around(6, 15) translate([0, 0, 9]) bolt(5, 3); }
