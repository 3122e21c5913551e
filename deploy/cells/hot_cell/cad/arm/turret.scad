// Yaw turret: drive barrel and the fork of the shoulder (axis along y, 150 mm below the origin).
include <../lib.scad>
translate([0, 0, -20]) disc(64, 20, 3);
translate([0, 0, -70]) disc(56, 54, 4);
around(8, 57, 22.5) translate([0, 0, -21]) mirror([0, 0, 1]) bolt(9, 5);
translate([0, 0, -84]) plate([84, 136], 20, 18);
for (s = [-1, 1]) translate([0, s * 58 + 8, 0]) rotate([90, 0, 0]) linear_extrude(16) hull() { translate([0, -150]) circle(42); translate([-40, -82]) square([80, 8]); }
for (s = [-1, 1]) rotate([0, 0, s > 0 ? 0 : 180]) translate([0, 65, -150]) rotate([-90, 0, 0]) { disc(34, 20, 4); around(6, 24) translate([0, 0, 19]) bolt(8, 5); }
