// Transfer cask: finned steel body, bolted lid with lifting eye, four lifting trunnions, feet. Origin: floor, centre.
include <lib.scad>
r = 165; h = 600;
function fin(z) = [[r, z], [r + 16, z + 3], [r + 16, z + 9], [r, z + 12]];
rotate_extrude($fn = 44) polygon(concat([[0, 30], [r - 10, 30], [r, 40], [r, 90]], [for (i = [0:5], p = fin(110 + 26 * i)) p],
  [for (i = [0:3], p = fin(330 + 26 * i)) p], [[r, 460], [r + 10, 470], [r + 10, h - 60], [r - 6, h - 44], [r - 6, h - 30], [r - 16, h - 18], [60, h - 18], [50, h - 8], [0, h - 8]]));
around(12, r - 28, 15) translate([0, 0, h - 19]) bolt(22, 14);
translate([0, 0, h - 12]) { cylinder(r = 22, h = 20); translate([0, 8, 44]) rotate([90, 0, 0]) rotate_extrude($fn = 32) translate([26, 0]) circle(8, $fn = 12); }
for (a = [0:90:270]) rotate(a) translate([r - 10, 0, 500]) rotate([0, 90, 0]) { disc(44, 26, 3); cylinder(r = 28, h = 62); translate([0, 0, 56]) disc(38, 14, 3); }
for (a = [45:90:315]) rotate(a) translate([r - 50, 0, 0]) plate([60, 60], 10, 34);
translate([-r - 2, -60, 230]) cube([14, 120, 80]);          // rating plate boss between the fins
