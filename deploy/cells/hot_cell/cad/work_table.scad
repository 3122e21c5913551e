// Stainless tray table: drained tray with a raised rim on a frame of square tubes. Origin: floor, centre.
include <lib.scad>
length = 1400; depth = 900; top = 300; rim = 28;
module leg() {
  plate([110, 110], 12, 10);
  translate([0, 0, 9]) plate([60, 60], 6, top - 19);
  for (s = [0:3]) rotate(90 * s + 45) translate([55, 0, 9]) cylinder(d = 18, h = 8, $fn = 6);
}
translate([0, 0, top - 12]) linear_extrude(12) difference() {
  rounded([length, depth], 24);
  translate([420, -260]) circle(30);                       // drain
  for (i = [-2:2]) translate([-560, 70 * i]) circle(9);    // holes for clamping fixtures
}
translate([0, 0, top - 24]) linear_extrude(24 + rim) difference() {
  rounded([length, depth], 24);
  rounded([length - 24, depth - 24], 13);
}
for (x = [-1, 1], y = [-1, 1]) translate([x * (length / 2 - 90), y * (depth / 2 - 90), 0]) leg();
for (y = [-1, 1]) translate([0, y * (depth / 2 - 90), 90]) block(length - 190, 40, 40);
for (x = [-1, 1]) translate([x * (length / 2 - 90), 0, 130]) block(40, depth - 190, 40);
translate([0, 0, top - 40]) block(50, depth - 60, 30);     // stiffener under the tray
