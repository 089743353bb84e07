for jitter in 0 10; do
  build/bin/palpate-lab replay --scene scenes/cube6.json --motion scenes/motions/base-excursion.csv --scheme port \
    --rtt-ms 20,50,100,150,200 --jitter-ms "$jitter" --out "out/mine/$jitter"
done
