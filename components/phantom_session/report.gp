# Plots of a session report, without titles: the page has captions. Run by phantom_session: gnuplot -e "folder='…'; …" report.gp
# reaches: numbers of those with the percept; objects: what each touched; contacts: whether any touched something; joint: number of the one
# that felt most (0: none), joint_name, position, effort: its name and what its axes are called; law: the bilateral law's name.
# gnuplot refuses to plot nothing.
series = folder."/series.csv"
set datafile separator ","
# Okabe and Ito's colours: told apart by the colour-blind too.
set linetype 1 lc rgb "#0072B2" lw 1.6
set linetype 2 lc rgb "#D55E00" lw 1.6
set linetype 3 lc rgb "#009E73" lw 1.6
set linetype 4 lc rgb "#CC79A7" lw 1.6
set linetype 5 lc rgb "#E69F00" lw 1.6
set linetype 6 lc rgb "#56B4E9" lw 1.6
set linetype 7 lc rgb "#000000" lw 1.6
set linetype cycle 7
set border 3
set tics nomirror out
set grid lc rgb "#dddddd"
shown(name) = system("printf '%s' '".name."' | tr _ ' '")

if (words(reaches) > 0) {
set terminal pngcairo size 1100,600 font "sans,13" background rgb "white"
set output folder."/torque_over_distance.png"
set xlabel "Distance to the nearest object [mm]"
set ylabel "Percept torque [N·m]"
set xrange [0:150]
set yrange [0:*]
set key top right Left reverse noenhanced
plot for [i=1:words(reaches)] series every ::1 using \
  (($2 == int(word(reaches, i)) && $3 == 1 && $4 == 1 && $5 >= 0) ? $5 * 1000 : NaN):6 with points pt 7 ps 0.7 lc i \
  title "reach ".word(reaches, i).", ".shown(word(objects, i))
unset xrange
unset yrange
}

if (contacts > 0) {
set terminal pngcairo size 800,500 font "sans,13" background rgb "white"
set output folder."/contact_speed.png"
set xlabel "Reach"
set ylabel "Speed of the tool at first contact [mm/s]"
set style fill solid 0.9 noborder
set boxwidth 0.7
set xtics 1
set xrange [-0.6:*]
set yrange [0:*]
set key outside above right horizontal
plot folder."/reaches.csv" every ::1 using 1:($2 == 1 ? $4 * 1000 : NaN) with boxes lc 1 title "with the percept", \
     "" every ::1 using 1:($2 == 0 ? $4 * 1000 : NaN) with boxes lc 2 title "without it"
set xtics autofreq
unset xrange
unset yrange
}

set lmargin 11
set rmargin 3
set key outside above right horizontal
set terminal pngcairo size 1100,1000 font "sans,12" background rgb "white"
set output folder."/session.png"
set multiplot layout 4,1
unset xlabel
set ylabel "Clearance [mm]"
set yrange [0:150]
plot series every ::1 using 1:($5 >= 0 ? $5 * 1000 : NaN) with lines notitle
set yrange [*:*]
set ylabel "Torque [N·m]"
plot series every ::1 using 1:6 with lines title "percept", "" every ::1 using 1:7 with lines title "slave feedback"
set ylabel "Speed of the tool [mm/s]"
plot series every ::1 using 1:($11 * 1000) with lines notitle
set ylabel "Contact force [N]"
set xlabel "Time [s]"
plot series every ::1 using 1:12 with lines notitle
unset multiplot

if (joint > 0) {
joints = folder."/joints.csv"
place(signal) = 3 + (joint - 1) * 5 + signal
set terminal pngcairo size 1100,850 font "sans,12" background rgb "white"
set output folder."/joint.png"
set multiplot layout 3,1 title shown(joint_name).", bilateral law ".system("echo ".law." | tr a-z A-Z") noenhanced
unset xlabel
set ylabel position
plot joints every ::1 using 1:(column(place(1))) with lines title "master", \
     "" every ::1 using 1:(column(place(2))) with lines title "slave"
set ylabel effort
plot joints every ::1 using 1:(column(place(3))) with lines lc 7 title "hand (MLT)"
set xlabel "Time [s]"
plot joints every ::1 using 1:(column(place(4))) with lines title "percept (PFFB)", \
     "" every ::1 using 1:(column(place(5))) with lines title (law eq "sctfb" ? "slave feedback (SCTFB)" : "slave feedback (SFFB)")
unset multiplot
}
