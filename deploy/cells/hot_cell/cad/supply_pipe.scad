// Straight run from the wall to the valve: wall sleeve, pipe, drain boss, flange. Along +x from the wall at x = 0;
// the flange's face at x = 780. Origin: axis, wall face.
include <lib.scad>
rotate([0, 90, 0]) {
  flange(120, 22, 8, 96, 22);
  translate([0, 0, 21]) cylinder(r1 = 62, r2 = 46, h = 40);
  cylinder(r = 45, h = 770, $fn = 40);
  translate([0, 0, 728]) cylinder(r1 = 45, r2 = 62, h = 34);
  translate([0, 0, 780]) mirror([0, 0, 1]) flange(100, 24, 8, 80, 20);
}
translate([300, 0, -40]) mirror([0, 0, 1]) { cylinder(r = 20, h = 60); translate([0, 0, 50]) disc(32, 18, 2); translate([0, 0, 60]) bolt(34, 30); }
translate([540, 0, 0]) rotate([0, 90, 0]) linear_extrude(36) difference() { circle(56); translate([-60, -60]) square([30, 120]); }
translate([558, 0, -752]) plate([40, 60], 5, 720);           // support post to the floor
translate([558, 0, -752]) plate([140, 140], 12, 12);
for (x = [-1, 1], y = [-1, 1]) translate([558 + 50 * x, 50 * y, -741]) bolt(20, 12);
