// Carriage of joint 1 with its drive. Origin: joint frame; joint 2 turns 60 mm below.
include <../lib.scad>
translate([0, 0, -42]) plate([190, 150], 14, 34);
translate([0, 0, -60]) disc(70, 20, 3);
translate([0, 0, -10]) block(120, 40, 22);
translate([-128, 0, -26]) rotate([0, 90, 0]) disc(28, 60, 5);
translate([-140, 0, -26]) rotate([0, 90, 0]) disc(20, 20, 4);
for (x = [-1, 1], y = [-1, 1]) translate([80 * x, 60 * y, -9]) bolt(14, 9);
