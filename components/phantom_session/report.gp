# Plots of a session report. Run by phantom_session: gnuplot -e "folder='…'" report.gp
# approach_rows, contacts, joint (0: none): what there is to draw; gnuplot refuses to plot nothing. law: its name.
series = folder."/series.csv"
reaches = folder."/reaches.csv"

if (approach_rows > 0) {
set datafile separator ","
set terminal pngcairo size 1100,600 font "sans,12" background rgb "white"
set grid
set output folder."/torque_over_distance.png"
set title "Percept torque against distance (reaches with percept, until first contact)"
set xlabel "distance to the nearest object [mm]"
set ylabel "greatest percept torque over the joints [N·m; sliding joints N]"
set xrange [0:150]
set key off
set cblabel "reach"
plot series every ::1 using (($3 == 1 && $4 == 1 && $5 >= 0) ? $5 * 1000 : NaN):6:2 with points pt 7 ps 0.6 palette
}

if (contacts > 0) {
reset
set datafile separator ","
set terminal pngcairo size 700,500 font "sans,12" background rgb "white"
set output folder."/contact_speed.png"
set title "Tool speed at first contact"
set ylabel "speed [mm/s]"
set xlabel "reach"
set grid ytics
set style fill solid 0.8
set boxwidth 0.8
set yrange [0:*]
set key top right
plot reaches every ::1 using 1:($2 == 1 ? $4 * 1000 : NaN) with boxes lc rgb "#2a7" title "with percept", \
     reaches every ::1 using 1:($2 == 0 ? $4 * 1000 : NaN) with boxes lc rgb "#c43" title "without percept"
}

reset
set datafile separator ","
set terminal pngcairo size 1100,900 font "sans,11" background rgb "white"
set output folder."/session.png"
set multiplot layout 4,1 title "The session over time"
set lmargin 10
set rmargin 3
set grid
set key top right
set ylabel "clearance [mm]"
set yrange [0:150]
plot series every ::1 using 1:($5 >= 0 ? $5 * 1000 : NaN) with lines lw 1.5 title "to the nearest object"
set yrange [*:*]
set ylabel "torque [N·m; sliding joints N]"
plot series every ::1 using 1:6 with lines lw 1.5 title "percept", series every ::1 using 1:7 with lines title "slave feedback"
set ylabel "speed [mm/s]"
plot series every ::1 using 1:($11 * 1000) with lines lw 1.5 title "tool"
set ylabel "force [N]"
set xlabel "time [s]"
plot series every ::1 using 1:12 with lines lw 1.5 title "contact"
unset multiplot

if (joint > 0) {
reset
set datafile separator ","
joints = folder."/joints.csv"
place(signal) = 3 + (joint - 1) * 5 + signal
set terminal pngcairo size 1100,800 font "sans,11" background rgb "white"
set output folder."/joint.png"
set multiplot layout 3,1 title sprintf("Joint %d under law %s", joint, law)
set lmargin 10
set rmargin 3
set grid
set key top right
set ylabel "position [rad; m]"
plot joints every ::1 using 1:(column(place(1))) with lines lw 1.5 title "master", \
     joints every ::1 using 1:(column(place(2))) with lines title "slave"
set ylabel "torque [N·m; N]"
plot joints every ::1 using 1:(column(place(3))) with lines lc rgb "#555" title "hand (MLT)"
set xlabel "time [s]"
plot joints every ::1 using 1:(column(place(4))) with lines lw 1.5 title "percept (PFFB)", \
     joints every ::1 using 1:(column(place(5))) with lines title (law eq "sctfb" ? "slave feedback (SCTFB)" : "slave feedback (SFFB)")
unset multiplot
}
