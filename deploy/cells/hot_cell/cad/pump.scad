// Centrifugal pump, close-coupled to a finned motor, on a base plate. Shaft along x. Origin: underside, centre.
include <lib.scad>
axis = 105;
linear_extrude(14) difference() { rounded([440, 180], 14); for (x = [-1, 1], y = [-1, 1]) translate([190 * x, 70 * y]) hull() { translate([-8, 0]) circle(7); translate([8, 0]) circle(7); } }
translate([0, 0, axis]) rotate([0, 90, 0]) {
  translate([0, 0, -30]) linear_extrude(190) union() {       // motor: finned barrel
    circle(62);
    for (i = [0:23]) rotate(15 * i) translate([58, -2]) square([16, 4]);
  }
  translate([0, 0, -44]) disc(70, 18, 4);                     // end bells
  translate([0, 0, 156]) disc(70, 16, 4);
  translate([0, 0, 170]) disc(66, 36, 12);                    // fan cowl
  translate([0, 0, -76]) cylinder(r1 = 46, r2 = 40, h = 40);  // lantern
  translate([0, 0, -122]) disc(84, 50, 12);                   // volute
  translate([0, 0, -180]) cylinder(r = 34, h = 64);
  translate([0, 0, -184]) flange(66, 18, 4, 52, 16);
}
translate([-97, 0, axis + 30]) { cylinder(r = 28, h = 100); translate([0, 0, 80]) flange(56, 18, 4, 44, 14); }
translate([-97 - 20, -50, 13]) cube([40, 100, 50]);           // feet
for (x = [10, 110]) translate([x, 0, 13]) { block(30, 130, 14); block(24, 90, 50); }
translate([60, -86, axis - 10]) block(70, 60, 70);            // terminal box
translate([60, -112, axis + 20]) rotate([90, 0, 0]) cylinder(r = 14, h = 26);
for (x = [10, 110], y = [-54, 54]) translate([x, y, 26]) bolt(14, 8);
