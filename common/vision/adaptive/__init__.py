"""Adaptive background model: learns behind people, follows light, takes up moved objects.

Every frame visits one row of `STRIDE`: a pixel that shows the background moves the mean, and every pixel has a candidate,
the colour that it shows, with the time since when.  Every `STRIDE` frames the regions that differ are judged:

- *alive*: a share of its pixels has changed within ALIVE_S.  The alive region at the place of the last silhouette, or else
  the largest, is the person, and nothing of it is learnt;
- *uncovered*: the model has an edge along a share of its outline where the frame has none.  Something has moved away, also
  a person who was there from the start: what is seen now is the room.  Of the outline of a part of a person who moves in
  place only little lies at edges of the room;
- *put down*: anything else that does not change, such as a chair that was moved.

What was uncovered, put down, or moved beside the person is learnt where it has not changed for STILL_S: the candidate
becomes the mean.  Should that ever have been the person, the room is uncovered when the person moves on.
After a sudden change of the light most of the image differs; see `zenocap.common.vision.relight`.

`model` has the state and its start, `follow` the way of a frame through it, `judgement` the verdicts on regions,
`learning` what pixels learn, `saved` the model between two runs of a viewer.

Left out alone, each of the parts costs 0.008 or more of the mean overlap in some situation, six seeds
(commit 23198ee, 2026-11-26).
"""
