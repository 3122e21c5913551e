// Upper arm: shoulder drum, ribbed tube, elbow fork. Along −z; elbow axis along y, 450 mm below the origin.
include <../lib.scad>
translate([0, 47, 0]) rotate([90, 0, 0]) disc(46, 94, 5);
translate([0, 0, -70]) cylinder(r1 = 36, r2 = 42, h = 50);
translate([0, 0, -372]) cylinder(r = 36, h = 310, $fn = 40);
for (i = [0:5]) rotate(60 * i) translate([34, -3, -330]) cube([7, 6, 260]);
for (z = [-90, -210, -350]) translate([0, 0, z]) disc(42, 14, 3);
translate([52, 0, -170]) plate([34, 44], 8, 110);             // elbow drive, mounted alongside
translate([36, 0, -150]) block(20, 30, 60);
translate([0, 0, -388]) plate([80, 108], 18, 24);
for (s = [-1, 1]) translate([0, s * 46 + 7, 0]) rotate([90, 0, 0]) linear_extrude(14) hull() { translate([0, -450]) circle(38); translate([-38, -384]) square([76, 6]); }
for (s = [-1, 1]) rotate([0, 0, s > 0 ? 0 : 180]) translate([0, 52, -450]) rotate([-90, 0, 0]) { disc(30, 14, 3); around(6, 20) translate([0, 0, 13]) bolt(7, 4); }
