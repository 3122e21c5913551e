// C-clamp holding the tray's rim: frame in the x–z plane, screw along z. Origin: middle of the jaw gap.
include <lib.scad>
translate([0, 13, 0]) rotate([90, 0, 0]) linear_extrude(26) offset(5) offset(-5) difference() {
  translate([50, 0]) rounded([150, 200], 26);
  translate([40, 0]) rounded([100, 128], 18);
  translate([-60, -64]) square([80, 128]);
}
translate([50, 0, -100]) plate([110, 14], 5, 14);
translate([0, 0, 9]) disc(16, 12, 2);                         // swivel pad
translate([0, 0, 18]) cylinder(r = 9, h = 152, $fn = 24);
for (i = [0:8]) translate([0, 0, 106 + 6 * i]) rotate_extrude($fn = 24) translate([8, 0]) circle(2.4, $fn = 8);
translate([0, 0, 164]) disc(13, 22, 3);
translate([-55, 0, 175]) rod_x(5, 110);
for (x = [-55, 55]) translate([x, 0, 175]) sphere(9, $fn = 16);
translate([0, 0, -72]) cylinder(r1 = 20, r2 = 15, h = 28);    // anvil
translate([-4, 0, 64]) plate([44, 34], 10, 38);               // screw boss
