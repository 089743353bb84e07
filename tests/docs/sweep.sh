for jitter in 0 10; do
  for rtt in 20 50 100 150 200; do
    build/bin/palpate-lab replay --scene scenes/cube6.json --motion scenes/motions/base-excursion.csv --scheme port \
      --rtt-ms "$rtt" --jitter-ms "$jitter" --out "out/mine/$jitter/$rtt" >/dev/null
  done
done
